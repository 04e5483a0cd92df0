#include "fusion/semantic/net/evidence.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <mutex>

#include "fusion/cloud/floor_index.hpp"
#include "fusion/cloud/parallel.hpp"

namespace parhelion::semantic {
namespace {

constexpr std::size_t kBlockBytes = 12'300;
constexpr std::size_t kSomeBlocks = 5'000;
constexpr double kReach = 1.6e7;  ///< cubes from the origin: a block's index has 21 bits per axis

bool is_in_reach(const Eigen::Vector3d& p, double cube) { return (p.array().abs() < kReach * cube).all(); }

/// The horizontal layers of cubes that are asked for, and the lines of sight that pass them.
class AskedLayers {
 public:
  AskedLayers(const cloud::PointCloud<Map>& cloud, const EvidenceOptions& options, int block_side) {
    if (options.asked.empty()) return;
    double lowest_eye = std::numeric_limits<double>::infinity(), highest_eye = -lowest_eye;
    Eigen::AlignedBox3f of_points;
    for (const Eigen::Vector3f& point : cloud.points) of_points.extend(point);
    Eigen::AlignedBox3d box = of_points.cast<double>();
    const double cube = options.cube;
    for (const Eigen::Vector3d& eye : cloud.viewpoints) {
      if (!is_in_reach(eye, cube)) return;
      box.extend(eye);
      lowest_eye = std::min(lowest_eye, eye.z());
      highest_eye = std::max(highest_eye, eye.z());
    }
    if (box.isEmpty() || !is_in_reach(box.min(), options.cube) || !is_in_reach(box.max(), options.cube))
      return;
    // Rounding may take a ray one cube out of the box.
    const Eigen::Array3d low = (box.min() / options.cube).array().floor() - 1,
                         high = (box.max() / options.cube).array().floor() + 1;
    // Where the number of blocks may reach its limit, each ray decides on which of them exist.
    const double blocks = ((high / block_side).floor() - (low / block_side).floor() + 1).prod();
    if (blocks > static_cast<double>(options.max_blocks)) return;
    all_ = false;
    low_ = low.cast<int>(), high_ = high.cast<int>();
    lowest_ = low_.z();
    const auto layers = static_cast<std::size_t>(high.z() - low.z() + 1);
    std::vector<std::uint8_t> is_asked(layers, 0);
    for (const HeightRange& range : options.asked) {
      const double from = std::max(low.z(), std::floor(range.low / options.cube)),
                   to = std::min(high.z(), std::floor(range.high / options.cube));
      for (double layer = from; layer <= to; ++layer) is_asked[static_cast<std::size_t>(layer - low.z())] = 1;
    }
    asked_below_.assign(layers + 1, 0);
    for (std::size_t k = 0; k < layers; ++k) asked_below_[k + 1] = asked_below_[k] + is_asked[k];
    for (std::size_t k = 0; k < layers; ++k) {
      const int layer = lowest_ + static_cast<int>(k);
      // What a ray passes on the way to any eye is passed on the way to the lowest or the highest, too.
      const auto by_ray_to = [&](double eye) { return are_between(layer, cloud::floor_index(eye / cube)); };
      const bool by_ray = !cloud.viewpoints.empty() && (by_ray_to(lowest_eye) || by_ray_to(highest_eye));
      concerned_.push_back(by_ray || is_asked[k] != 0);
    }
  }

  /// All of them: each ray may decide on which blocks there is memory for.
  bool all() const { return all_; }
  /// Cubes with the lowest and the highest indices that a ray may pass; not of all().
  const Eigen::Array3i& low() const { return low_; }
  const Eigen::Array3i& high() const { return high_; }
  /// Whether a line of sight between two layers may pass one that is asked for.
  bool are_between(int one, int other) const {
    if (all_) return true;
    const auto [low, high] = std::minmax(one, other);
    const auto from = static_cast<std::size_t>(std::max(low - 1 - lowest_, 0));
    const auto to = std::min(static_cast<std::size_t>(high + 2 - lowest_), asked_below_.size() - 1);
    return asked_below_[to] > asked_below_[from];
  }
  /// Whether this layer is asked for, or a line of sight from some viewpoint to it passes one that is.
  bool concern(int layer) const { return all_ || concerned_[static_cast<std::size_t>(layer - lowest_)]; }

 private:
  bool all_ = true;
  Eigen::Array3i low_ = Eigen::Array3i::Zero(), high_ = low_;
  int lowest_ = 0;
  std::vector<std::uint32_t> asked_below_;  ///< per layer, and one more: number of those under it
  std::vector<bool> concerned_;             ///< per layer
};

}  // namespace

/// From cube to cube (Amanatides and Woo 1987), excluding the one in which the ray ends.
template <class BlockAt, class Mark>
void EvidenceGrid::follow(const Eigen::Vector3d& eye, const Eigen::Vector3d& end, BlockAt&& block_of_cube,
                          Mark&& mark) const {
  const Eigen::Vector3d ray = end - eye;
  if (!(ray.norm() <= options_.range)) return;
  Index at = index_of(eye);
  const Index last = index_of(end);
  Index step = Index::Zero();
  Eigen::Array3d next,
      each;  // ray parameters of the next border along each axis, and of one cube
  for (int axis = 0; axis < 3; ++axis) {
    next[axis] = each[axis] = std::numeric_limits<double>::infinity();
    if (ray[axis] == 0) continue;
    step[axis] = ray[axis] > 0 ? 1 : -1;
    each[axis] = options_.cube / std::abs(ray[axis]);
    next[axis] = ((at[axis] + (step[axis] > 0 ? 1 : 0)) * options_.cube - eye[axis]) / ray[axis];
  }
  // The index within a block at which a ray enters it.
  const Index entered = step.unaryExpr([](int s) { return s > 0 ? 0 : kSide - 1; });
  Block* block = nullptr;
  bool new_block = true;
  for (int left = (last - at).abs().sum(); left > 0; --left) {
    if (new_block) block = block_of_cube(at);
    if (block != nullptr) mark(block->cubes[place_in(at)]);
    // To the nearest border; a selection by index would wait for memory in each cube.
    const bool not_x = next[1] < next[0], along_z = next[2] < (not_x ? next[1] : next[0]);
    const std::array<bool, 3> along = {!not_x && !along_z, not_x && !along_z, along_z};
    new_block = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<Eigen::Index>(axis);
      next[k] += along[axis] ? each[k] : 0;
      at[k] += along[axis] ? step[k] : 0;
      new_block = new_block || (along[axis] && (at[k] & (kSide - 1)) == entered[k]);
    }
  }
}

EvidenceGrid::EvidenceGrid(const cloud::PointCloud<Map>& cloud, const EvidenceOptions& options)
    : options_(options) {
  if (options_.max_blocks == 0)
    options_.max_blocks = kSomeBlocks + cloud.size() * sizeof(Eigen::Vector3f) / kBlockBytes;
  // A measured cube stays measured even if a line of sight crosses its corner. Where memory may not suffice
  // surfaces get theirs first.
  const AskedLayers asked(cloud, options_, kSide);
  const auto layer_of = [&](const Eigen::Vector3d& p) { return cloud::floor_index(p.z() / options_.cube); };
  const bool surfaces_first = asked.all() || cloud.viewpoints.empty();
  for (std::size_t i = 0; i < cloud.size() && surfaces_first; ++i) {
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    if (!is_in_reach(p, options_.cube) || !asked.concern(layer_of(p))) continue;
    const Index cube = index_of(p);
    if (Block* block = block_at(cube, true)) block->cubes[place_in(cube)] = Evidence::measured;
  }
  if (cloud.viewpoints.empty()) return;
  const auto at_once = [&](const Index& cube) { return block_at(cube, true); };
  const auto mark = [](Evidence& cube) { cube = std::max(cube, Evidence::seen_through); };
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::size_t view = cloud.scans.empty() ? 0 : cloud.scans[i];
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    if (!is_in_reach(p, options_.cube) || !asked.concern(layer_of(p))) continue;
    const Index cube = index_of(p);
    Block* block = block_at(cube, !surfaces_first);
    if (block == nullptr) continue;
    if (!surfaces_first) block->cubes[place_in(cube)] = Evidence::measured;
    if (view >= cloud.viewpoints.size()) continue;
    std::uint16_t& followed = block->followed[place_in(cube)];
    const auto by_view = static_cast<std::uint16_t>(view + 1);
    if (followed == by_view) continue;
    followed = by_view;
    const Eigen::Vector3d& eye = cloud.viewpoints[view];
    if (asked.all())
      follow(eye, p, at_once, mark);
    else if (asked.are_between(layer_of(eye), cube.z()))
      rays.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(view)});
  }
  if (!rays.empty()) follow_all(cloud, rays, asked.low(), asked.high());
}

void EvidenceGrid::follow_all(const cloud::PointCloud<Map>& cloud, const std::vector<Ray>& rays,
                              const Index& low, const Index& high) {
  constexpr std::size_t kChunk = 256;  // rays
  const auto block_index = [](int i) { return i >> std::countr_zero(unsigned{kSide}); };
  const Index first = low.unaryExpr(block_index), size = high.unaryExpr(block_index) - first + 1;
  std::vector<std::atomic<Block*>> blocks(static_cast<std::size_t>(size.prod()));
  const auto place_of = [&](const Index& cube) {
    const Index at = cube.unaryExpr(block_index) - first;
    return static_cast<std::size_t>((at.z() * size.y() + at.y()) * size.x() + at.x());
  };
  for (Block& block : blocks_) blocks[place_of(block.first)].store(&block, std::memory_order_relaxed);
  std::mutex making;
  const auto block_of_cube = [&](const Index& cube) -> Block* {
    if ((cube < low).any() || (cube > high).any()) return nullptr;
    std::atomic<Block*>& block = blocks[place_of(cube)];
    if (Block* made = block.load(std::memory_order_acquire)) return made;
    const std::lock_guard lock(making);
    if (block.load(std::memory_order_relaxed) == nullptr)
      block.store(block_at(cube, true), std::memory_order_release);
    return block.load(std::memory_order_relaxed);
  };
  // Measured cubes are all marked: what is left to write is the same for all rays.
  const auto mark = [](Evidence& cube) {
    const std::atomic_ref shared(cube);
    if (shared.load(std::memory_order_relaxed) == Evidence::unobserved)
      shared.store(Evidence::seen_through, std::memory_order_relaxed);
  };
  cloud::for_each_chunk(rays.size(), kChunk, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      follow(cloud.viewpoints[rays[i].view], cloud.points[rays[i].point].cast<double>(), block_of_cube, mark);
  });
}

std::uint64_t EvidenceGrid::key_of(const Index& cube) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis)
    key = key << 21 | (static_cast<std::uint64_t>((cube[axis] >> 4) + (1 << 20)) & 0x1FFFFF);
  return key;
}

std::size_t EvidenceGrid::place_in(const Index& cube) {
  return static_cast<std::size_t>((cube[2] & 15) << 8 | (cube[1] & 15) << 4 | (cube[0] & 15));
}

EvidenceGrid::Block* EvidenceGrid::block_at(const Index& cube, bool make) {
  const std::uint64_t key = key_of(cube);
  if (key == last_key_) return last_;
  const auto found = block_of_.find(key);
  if (found == block_of_.end() && (!make || blocks_.size() >= options_.max_blocks)) return nullptr;
  if (found == block_of_.end()) {
    block_of_.emplace(key, static_cast<std::uint32_t>(blocks_.size()));
    blocks_.emplace_back();
    blocks_.back().first = cube.unaryExpr([](int i) { return i >> 4 << 4; });
    last_ = &blocks_.back();
  } else {
    last_ = &blocks_[found->second];
  }
  last_key_ = key;
  return last_;
}

Evidence EvidenceGrid::at(const Eigen::Vector3d& p) const {
  if (!is_in_reach(p, options_.cube)) return Evidence::unobserved;
  const Index cube = index_of(p);
  const auto found = block_of_.find(key_of(cube));
  return found == block_of_.end() ? Evidence::unobserved : blocks_[found->second].cubes[place_in(cube)];
}

std::size_t EvidenceGrid::count(Evidence kind) const {
  std::size_t sum = 0;
  for (const Block& block : blocks_)
    sum += static_cast<std::size_t>(std::count(block.cubes.begin(), block.cubes.end(), kind));
  return sum;
}

cloud::PointCloud<Map> EvidenceGrid::centres() const {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  for (std::uint32_t i = 0; i < blocks_.size(); ++i) order.emplace_back(key_of(blocks_[i].first), i);
  std::sort(order.begin(), order.end());
  cloud::PointCloud<Map> cloud;
  for (const auto& [key, number] : order) {
    const Block& block = blocks_[number];
    for (std::size_t k = 0; k < block.cubes.size(); ++k) {
      if (block.cubes[k] == Evidence::unobserved) continue;
      const Index cube = block.first + Index(static_cast<int>(k & 15), static_cast<int>(k >> 4 & 15),
                                             static_cast<int>(k >> 8));
      cloud.points.push_back((options_.cube * (cube.cast<double>() + 0.5)).matrix().cast<float>());
      cloud.labels.push_back(block.cubes[k] == Evidence::measured ? 0 : 1);
    }
  }
  return cloud;
}

}  // namespace parhelion::semantic
