#include "fusion/semantic/stray_points.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>

#include "fusion/cloud/parallel.hpp"
#include "fusion/cloud/voxel_index.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kCell = 0.025;                  // m
constexpr int kCellBits = 2;                     // cells along a cube: 4, so that one word has a bit for each
constexpr double kCube = 4 * kCell;              // m
constexpr int kBlockBits = 3;                    // cubes along a block: 8
constexpr double kTooSparse = 0.099;             // m, of a spacing: strays are as close to others
constexpr std::uint32_t kSolid = 10;             // points of a cube that need no look
constexpr std::size_t kFewest = 8;               // cells that are linked, of a surface or a thin thing
constexpr double kLink = 2.5;                    // spacings, to the next point of the same surface
constexpr double kMinLink = 2, kMaxLink = 12;    // cells
constexpr double kUsual = 0.3, kSparsest = 0.1;  // fractions of the points around whose spacing is larger
constexpr double kFar = 3;                       // links, to other points of a sparse surface
constexpr double kFlat = 0.012;                  // m, of the points of a sparse surface, to either side
constexpr std::size_t kFewestFlat = 6;           // points of it
constexpr double kClean = 0.003, kMaxStrays = 0.2;  // fractions of a cloud
constexpr std::size_t kSmall = 50'000;              // points, that are all looked at
constexpr std::size_t kEnough = 1'000;              // points of a sample
constexpr int kColumnCubes = 16;                    // along a sampled column
constexpr int kMargin = 3;                          // cubes at its edge, of which not all is known
constexpr int kFace = 32;                           // cells along a face of a cube of directions
constexpr std::size_t kFewRays = 1'000;             // of a view whose angle between rays is not known

struct Cube {
  Eigen::Vector3i index;
  std::uint64_t cells = 0;
  std::uint32_t points = 0;
};

/// Cells of a cube with `low` to `high` along one axis (0: x, 2 bits of the number per axis).
std::uint64_t slab(int axis, int low, int high) {
  constexpr std::array<std::uint64_t, 3> first = {0x1111'1111'1111'1111u, 0x000F'000F'000F'000Fu, 0xFFFFu};
  std::uint64_t cells = 0;
  for (int k = low; k <= high; ++k) cells |= first[static_cast<std::size_t>(axis)] << (k << (2 * axis));
  return cells;
}

/// The angle between neighbouring rays of each view: the root of the solid angle that it covers by its number
/// of points; 0: not known.
std::vector<double> ray_spacings(const cloud::PointCloud<Cloud>& cloud) {
  std::vector<std::size_t> rays(cloud.viewpoints.size());
  if (rays.empty()) return {};
  constexpr std::size_t faces = 6 * kFace * kFace;
  const std::size_t step = std::clamp<std::size_t>(cloud.size() / (faces * rays.size()), 1, 8);
  const auto view_of = [&](std::size_t i) { return cloud.scans.empty() ? std::size_t{0} : cloud.scans[i]; };
  for (std::size_t i = 0; i < cloud.size(); i += step) {
    if (view_of(i) < rays.size()) rays[view_of(i)] += step;
  }
  std::vector<std::vector<bool>> seen(rays.size());
  for (std::size_t i = 0; i < cloud.size(); i += step) {
    const std::size_t view = view_of(i);
    if (view >= rays.size() || rays[view] < kFewRays) continue;
    std::vector<bool>& of_view = seen[view];
    if (of_view.empty()) of_view.resize(faces);
    const Eigen::Vector3f ray = cloud.points[i] - cloud.viewpoints[view].cast<float>();
    Eigen::Index axis = 0;
    const float depth = ray.cwiseAbs().maxCoeff(&axis);
    if (!(depth > 0)) continue;
    const auto place = [&](Eigen::Index k) {
      return std::clamp(static_cast<int>((ray[k % 3] / depth + 1) * (0.5F * kFace)), 0, kFace - 1);
    };
    const auto face = 2 * static_cast<int>(axis) + (ray[axis] < 0 ? 1 : 0);
    of_view[static_cast<std::size_t>((face * kFace + place(axis + 1)) * kFace + place(axis + 2))] = true;
  }
  std::vector<double> spacings(rays.size());
  for (std::size_t v = 0; v < rays.size(); ++v) {
    const auto cells = static_cast<double>(std::count(seen[v].begin(), seen[v].end(), true));
    const double solid = 4 * std::numbers::pi * cells / static_cast<double>(faces);
    if (cells > 0) spacings[v] = std::sqrt(solid / static_cast<double>(rays[v]));
  }
  return spacings;
}

class StraySearch {
 public:
  /// `sample`: only a quarter of the points of every eighth column of 1.6 m, to know whether there are any.
  StraySearch(const cloud::PointCloud<Cloud>& cloud, bool sample) : cloud_(cloud), sample_(sample) {
    Eigen::AlignedBox3f bounds;
    for (const Eigen::Vector3f& p : cloud.points) bounds.extend(p);
    // No index becomes negative within the widest link.
    origin_ = bounds.min().array() - static_cast<float>(kColumnCubes * kCube);
    fill_cubes();
    measure_blocks();
    find();
  }

  std::size_t judged() const { return judged_; }  ///< points
  /// Of the points that were judged.
  double fraction() const {
    return judged_ > 0 ? static_cast<double>(strays_) / static_cast<double>(judged_) : 0;
  }
  /// Per point, whether it is one.
  std::vector<bool> strays() const { return {alone_.begin(), alone_.end()}; }

 private:
  using Counts = std::array<std::uint32_t, 33>;  ///< points, by the bits of the number in their cube
  struct Spacing {
    double usual, sparsest;  ///< m
  };

  /// The numbers of the cubes about one, as they were asked for: points in sequence ask for the same.
  class Lookup {
   public:
    explicit Lookup(const cloud::VoxelIndex& index) : index_(index) {}
    std::uint32_t at(const Eigen::Vector3i& cube) {
      const Eigen::Vector3i off = (cube - middle_).array() + 1;
      if ((off.array() < 0).any() || (off.array() > 2).any()) return index_.at(cube);
      std::uint32_t& number = numbers_[static_cast<std::size_t>(off.x() + 3 * off.y() + 9 * off.z())];
      if (number == kUnasked) number = index_.at(cube);
      return number;
    }
    void move_to(const Eigen::Vector3i& cube) {
      if (cube == middle_) return;
      middle_ = cube;
      numbers_.fill(kUnasked);
    }

   private:
    static constexpr std::uint32_t kUnasked = cloud::VoxelIndex::kNone - 1;
    const cloud::VoxelIndex& index_;
    Eigen::Vector3i middle_ = Eigen::Vector3i::Constant(-9);
    std::array<std::uint32_t, 27> numbers_{};
  };

  Eigen::Vector3i cell_of(const Eigen::Vector3f& p) const {
    return ((p - origin_) * static_cast<float>(1 / kCell)).cast<int>();
  }

  static int of_column(int cube) { return cube & (kColumnCubes - 1); }
  static bool in_sample(const Eigen::Vector3i& cube) {
    return ((cube.x() / kColumnCubes + 3 * (cube.y() / kColumnCubes)) & 7) == 0;
  }
  /// Whether all around it is known.
  bool is_judged(const Eigen::Vector3i& cube) const {
    const auto inside = [](int at) { return at >= kMargin && at < kColumnCubes - kMargin; };
    return !sample_ || (inside(of_column(cube.x())) && inside(of_column(cube.y())));
  }

  void fill_cubes() {
    cube_of_.assign(cloud_.size(), cloud::VoxelIndex::kNone);
    Eigen::Vector3i last = Eigen::Vector3i::Constant(-1);
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < cloud_.size(); ++i) {
      const Eigen::Vector3i cell = cell_of(cloud_.points[i]);
      const Eigen::Vector3i index = cell.unaryExpr([](int c) { return c >> kCellBits; });
      if (sample_ && !in_sample(index)) continue;
      if (index != last) {
        std::uint32_t& of_cube = index_[index];
        if (of_cube == cloud::VoxelIndex::kNone) {
          of_cube = static_cast<std::uint32_t>(cubes_.size());
          cubes_.push_back({index});
        }
        number = of_cube, last = index;
      }
      cube_of_[i] = number;
      Cube& cube = cubes_[number];
      ++cube.points;
      cube.cells |= std::uint64_t{1} << ((cell.x() & 3) + 4 * (cell.y() & 3) + 16 * (cell.z() & 3));
    }
  }

  /// m, the spacing of the sparsest points in and around each block.
  void measure_blocks() {
    const auto block_of = [](const Cube& cube) -> Eigen::Vector3i {
      return cube.index.unaryExpr([](int c) { return c >> kBlockBits; });
    };
    std::vector<Counts> counts;
    std::vector<Eigen::Vector3i> blocks;
    block_of_.resize(cubes_.size());
    cloud::VoxelIndex numbers;
    for (std::size_t c = 0; c < cubes_.size(); ++c) {
      std::uint32_t& number = numbers[block_of(cubes_[c])];
      if (number == cloud::VoxelIndex::kNone) {
        number = static_cast<std::uint32_t>(counts.size());
        counts.push_back({});
        blocks.push_back(block_of(cubes_[c]));
      }
      block_of_[c] = number;
      counts[number][static_cast<std::size_t>(std::bit_width(cubes_[c].points))] += cubes_[c].points;
    }
    Counts all{};
    for (const Counts& of_block : counts) add(of_block, all);
    const double largest = 2 * spacing_at(all, kUsual);
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      Counts around{};
      numbers.for_each_about(blocks[b], [&](std::uint32_t other) { add(counts[other], around); });
      // Amid a hall there may be strays only.
      spacing_.push_back({std::min(spacing_at(around, kUsual), largest), spacing_at(around, kSparsest)});
    }
  }
  static void add(const Counts& counts, Counts& sum) {
    for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += counts[k];
  }
  /// m, where that fraction of the points is sparser.
  static double spacing_at(const Counts& counts, double fraction) {
    const double all = std::accumulate(counts.begin(), counts.end(), 0.0);
    double sparser = counts[1];
    std::size_t k = 1;
    while (k + 1 < counts.size() && sparser < fraction * all) sparser += counts[++k];
    return kCube / std::sqrt(std::ldexp(1.0, static_cast<int>(k) - 1));
  }

  void find() {
    const std::vector<double> rays = ray_spacings(cloud_);
    alone_.resize(cloud_.size());
    struct Sum {
      std::size_t judged = 0, strays = 0;
      Sum& operator+=(const Sum& other) {
        judged += other.judged, strays += other.strays;
        return *this;
      }
    };
    constexpr std::size_t kChunk = 16'384;
    const auto sum =
        cloud::sum_over_chunks<Sum>(cloud_.size(), kChunk, 0, [&](std::size_t begin, std::size_t end) {
          Sum part;
          Lookup lookup(index_);
          for (std::size_t i = begin; i < end; i += sample_ ? 4 : 1) {
            if (cube_of_[i] == cloud::VoxelIndex::kNone || !is_judged(cubes_[cube_of_[i]].index)) continue;
            alone_[i] = cubes_[cube_of_[i]].points < kSolid && is_alone(i, rays, lookup);
            part += {1, alone_[i]};
          }
          return part;
        });
    judged_ = sum.judged, strays_ = sum.strays;
  }

  bool is_alone(std::size_t i, const std::vector<double>& rays, Lookup& lookup) const {
    lookup.move_to(cubes_[cube_of_[i]].index);
    Spacing spacing = spacing_[block_of_[cube_of_[i]]];
    const std::size_t view = cloud_.scans.empty() ? 0 : cloud_.scans[i];
    if (view < rays.size() && rays[view] > 0) {
      // A cloud that was thinned is sparser than its rays.
      const double of_rays = rays[view] * (cloud_.points[i].cast<double>() - cloud_.viewpoints[view]).norm();
      spacing = {std::max(spacing.usual, of_rays), std::max(spacing.sparsest, of_rays)};
    }
    if (spacing.usual > kTooSparse) return false;
    const auto in_cells = [](double length) {
      return std::clamp(kLink * length / kCell, kMinLink, kMaxLink);
    };
    const Eigen::Vector3i cell = cell_of(cloud_.points[i]);
    return linked_cells(lookup, cell, in_cells(spacing.usual)) < kFewest &&
           !on_sparse_surface(lookup, cell, std::min(kFar * in_cells(spacing.sparsest), kMaxLink));
  }

  /// Calls visit(cube, cell) for the occupied cells within `reach` cells of `middle`; it returns whether to
  /// go on.
  template <class Visit>
  void for_each_near(Lookup& lookup, const Eigen::Vector3i& middle, double reach, Visit&& visit) const {
    const int square = static_cast<int>(reach * reach);
    const Eigen::Vector3i low = middle.array() - static_cast<int>(reach),
                          high = middle.array() + static_cast<int>(reach);
    const auto cube = [](int c) { return c >> kCellBits; };
    for (int z = cube(low.z()); z <= cube(high.z()); ++z) {
      for (int y = cube(low.y()); y <= cube(high.y()); ++y) {
        for (int x = cube(low.x()); x <= cube(high.x()); ++x) {
          const std::uint32_t number = lookup.at({x, y, z});
          if (number == cloud::VoxelIndex::kNone) continue;
          std::uint64_t cells = cubes_[number].cells & within({x, y, z}, low, high);
          for (; cells != 0; cells &= cells - 1) {
            const int bit = std::countr_zero(cells);
            const Eigen::Vector3i cell(4 * x + (bit & 3), 4 * y + (bit >> 2 & 3), 4 * z + (bit >> 4));
            if ((cell - middle).squaredNorm() <= square && !visit(cubes_[number], cell)) return;
          }
        }
      }
    }
  }

  /// Whether it lies on the plane through the cells around: panes that return few rays, what is far away.
  bool on_sparse_surface(Lookup& lookup, const Eigen::Vector3i& cell, double reach) const {
    constexpr std::size_t kMaxCells = 256;
    std::size_t count = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for_each_near(lookup, cell, reach, [&](const Cube&, const Eigen::Vector3i& other) {
      const Eigen::Vector3d d = kCell * (other - cell).cast<double>();
      sum += d, squares += d * d.transpose();
      return ++count < kMaxCells;
    });
    if (count < kFewestFlat) return false;
    const auto n = static_cast<double>(count);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares / n -
                                                                sum * sum.transpose() / (n * n));
    return solver.eigenvalues()[0] < kFlat * kFlat &&
           std::abs(solver.eigenvectors().col(0).dot(sum) / n) < 2 * kFlat;
  }

  /// Number of occupied cells, up to kFewest, that are reached from `first` in steps of at most `link` cells.
  std::size_t linked_cells(Lookup& lookup, const Eigen::Vector3i& first, double link) const {
    std::array<Eigen::Vector3i, kFewest> linked{first};
    std::size_t count = 1;
    for (std::size_t k = 0; k < count && count < kFewest; ++k) {
      for_each_near(lookup, linked[k], link, [&](const Cube& cube, const Eigen::Vector3i& cell) {
        const auto end = linked.begin() + static_cast<std::ptrdiff_t>(count);
        if (cube.points >= kSolid)
          count = kFewest;
        else if (std::find(linked.begin(), end, cell) == end)
          linked[count++] = cell;
        return count < kFewest;
      });
    }
    return count;
  }

  /// Cells of a cube between two cells, inclusive.
  static std::uint64_t within(const Eigen::Vector3i& cube, const Eigen::Vector3i& low,
                              const Eigen::Vector3i& high) {
    std::uint64_t cells = ~std::uint64_t{0};
    for (int axis = 0; axis < 3; ++axis) {
      const int from = std::max(low[axis] - 4 * cube[axis], 0), to = std::min(high[axis] - 4 * cube[axis], 3);
      if (from > 0 || to < 3) cells &= slab(axis, from, to);
    }
    return cells;
  }

  const cloud::PointCloud<Cloud>& cloud_;
  bool sample_;
  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero();
  cloud::VoxelIndex index_;
  std::vector<Cube> cubes_;
  std::vector<std::uint32_t> cube_of_;   ///< per point
  std::vector<std::uint32_t> block_of_;  ///< per cube
  std::vector<Spacing> spacing_;         ///< per block
  std::vector<std::uint8_t> alone_;      ///< per point
  std::size_t judged_ = 0, strays_ = 0;
};

}  // namespace

std::vector<bool> stray_points(const cloud::PointCloud<Cloud>& cloud) {
  if (cloud.size() > kSmall) {
    const StraySearch sample(cloud, true);
    if (sample.judged() > kEnough && sample.fraction() < kClean) return {};
  }
  const StraySearch search(cloud, false);
  if (search.fraction() < kClean || search.fraction() > kMaxStrays) return {};
  return search.strays();
}

}  // namespace parhelion::semantic
