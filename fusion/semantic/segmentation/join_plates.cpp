#include "fusion/semantic/segmentation/join_plates.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <utility>

#include "fusion/cloud/parallel.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kSameHeight = 0.008;    // m, between cells of one surface, in addition to noise
constexpr double kPointNoise = 0.01;     // m
constexpr double kMaxHeightStep = 0.03;  // m, independent of the noise
constexpr int kReachCells = 4;           // a gap of one cell does not split a surface
constexpr double kSliceFraction = 0.17;  // fraction of a wall's points in a slice: 0.1 m of 0.6 m

constexpr std::size_t kChunk = 2048;  // plates, of the work of one thread

/// m, maximum difference of two cells of one surface: 2.5 sigma of their means plus the floor's unevenness.
double height_step(const Plate& a, const Plate& b) {
  const double sigma = kPointNoise * std::sqrt(1.0 / a.points + 1.0 / b.points);
  return std::min(kMaxHeightStep, kSameHeight + 2.5 * sigma);
}

bool of_one_height(const Plate& a, const Plate& b) {
  return static_cast<double>(std::abs(b.z - a.z)) <= height_step(a, b);
}

/// Whether the plate contains more of the points around its height than a wall's slice does by chance. Such
/// slices are not flat; nor is the floor's rim at the foot of a wall.
bool is_flat(const Plate& plate) {
  const double n = plate.points + plate.around, mean = kSliceFraction * n;
  return plate.points > mean + 2 * std::sqrt(mean * (1 - kSliceFraction));
}

/// Ascends with y, then x.
std::int64_t cell_key(std::int64_t x, std::int64_t y) { return (y << 32) + x; }

constexpr float kFarthest = 0.031F;  // m, a little more than kMaxHeightStep

/// Cells and heights of plates, close together in memory.
struct Places {
  std::vector<std::int64_t> cell;
  std::vector<float> z;

  explicit Places(const std::vector<Plate>& plates) {
    for (const Plate& plate : plates) {
      cell.push_back(cell_key(plate.x, plate.y));
      z.push_back(plate.z);
    }
  }
};

constexpr std::size_t kBatch = 16;

/// Of the next `kBatch` heights, most of which are others at walls. Free of branches, so that it is
/// vectorized.
bool any_near(const float* heights, float height) {
  int near = 0;
  for (std::size_t k = 0; k < kBatch; ++k) near |= std::abs(heights[k] - height) <= kFarthest ? 1 : 0;
  return near != 0;
}

/// Calls visit(i, j) once for each two plates within reach of which the heights may be those of one surface.
/// i < j; all i in [first, last).
template <class Visit>
void for_each_pair(const Places& places, std::size_t first, std::size_t last, Visit&& visit) {
  const std::vector<std::int64_t>& cell = places.cell;
  const std::vector<float>& z = places.z;
  // Where the neighbours in each row begin and end: these places move on with the plates.
  struct Range {
    std::size_t begin = 0, end = 0;
  };
  std::array<Range, kReachCells + 1> rows{};
  for (int dy = 0; dy <= kReachCells && first < last; ++dy) {
    const std::int64_t from = cell[first] + cell_key(dy == 0 ? 1 : -kReachCells, dy);
    const auto begin = std::lower_bound(cell.begin(), cell.end(), from) - cell.begin();
    rows[static_cast<std::size_t>(dy)] = {static_cast<std::size_t>(begin), static_cast<std::size_t>(begin)};
  }
  for (std::size_t i = first; i < last; ++i) {
    for (int dy = 0; dy <= kReachCells; ++dy) {
      const std::int64_t from = cell[i] + cell_key(dy == 0 ? 1 : -kReachCells, dy),
                         to = cell[i] + cell_key(kReachCells, dy);
      auto& [begin, end] = rows[static_cast<std::size_t>(dy)];
      while (begin < cell.size() && cell[begin] < from) ++begin;
      end = std::max(begin, end);
      while (end < cell.size() && cell[end] <= to) ++end;
      for (std::size_t j = begin; j < end;) {
        const std::size_t batch_end = std::min(end, j + kBatch);
        if (j + kBatch <= end && !any_near(z.data() + j, z[i])) j = batch_end;
        for (; j < batch_end; ++j) {
          if (std::abs(z[j] - z[i]) <= kFarthest)
            visit(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
        }
      }
    }
  }
}

/// Sets that several threads join; the first member is a set's root, whatever the order in which they do
/// (Anderson and Woll 1991, "Wait-free parallel algorithms for the union-find problem").
class Sets {
 public:
  explicit Sets(std::size_t size) : parent_(size) {
    for (std::uint32_t i = 0; i < size; ++i) parent_[i].store(i, std::memory_order_relaxed);
  }
  std::uint32_t root(std::uint32_t i) {
    for (std::uint32_t up = parent(i); up != i; up = parent(i)) {
      const std::uint32_t over = parent(up);
      parent_[i].store(over, std::memory_order_relaxed);
      i = over;
    }
    return i;
  }
  /// Quick; false of some that are joined.
  bool are_joined(std::uint32_t a, std::uint32_t b) const { return parent(a) == parent(b); }
  void join(std::uint32_t a, std::uint32_t b) {
    for (;;) {
      a = root(a), b = root(b);
      if (a == b) return;
      if (a > b) std::swap(a, b);
      std::uint32_t still_root = b;
      if (parent_[b].compare_exchange_weak(still_root, a, std::memory_order_relaxed)) return;
    }
  }

 private:
  std::uint32_t parent(std::uint32_t i) const { return parent_[i].load(std::memory_order_relaxed); }
  std::vector<std::atomic<std::uint32_t>> parent_;  ///< never after its child
};

/// Of each plate the flat neighbour that is nearest in height; of equally near ones the first.
class Hosts {
 public:
  explicit Hosts(std::size_t size) : nearest_(size) {
    for (auto& nearest : nearest_) nearest.store(kNobody, std::memory_order_relaxed);
  }
  void offer(std::uint32_t child, std::uint32_t host, float away) {
    // Bits of floats that are not negative ascend with them.
    const std::uint64_t offered = std::uint64_t{std::bit_cast<std::uint32_t>(away)} << 32 | host;
    std::uint64_t nearest = nearest_[child].load(std::memory_order_relaxed);
    while (offered < nearest &&
           !nearest_[child].compare_exchange_weak(nearest, offered, std::memory_order_relaxed)) {
    }
  }
  /// The plate itself where it has none.
  std::uint32_t of(std::uint32_t child) const {
    const std::uint64_t nearest = nearest_[child].load(std::memory_order_relaxed);
    return nearest == kNobody ? child : static_cast<std::uint32_t>(nearest);
  }

 private:
  static constexpr std::uint64_t kNobody = ~std::uint64_t{0};
  std::vector<std::atomic<std::uint64_t>> nearest_;
};

/// Numbers the components; those marked `apart` join nothing.
std::vector<std::uint32_t> components(const std::vector<Plate>& plates, const Places& places,
                                      const std::vector<bool>& apart) {
  Sets sets(plates.size());
  Hosts hosts(plates.size());
  // What a plate's neighbours need of it first, close together in memory.
  std::vector<std::uint8_t> flat;
  for (const Plate& plate : plates) flat.push_back(is_flat(plate) ? 1 : 0);
  const auto meet = [&](std::uint32_t i, std::uint32_t j) {
    const bool one = flat[i] != 0, other = flat[j] != 0;
    if ((!one && !other) || (one && other && sets.are_joined(i, j))) return;
    if (apart[i] || apart[j] || !of_one_height(plates[i], plates[j])) return;
    if (one && other) {
      sets.join(i, j);
    } else {
      const float away = std::abs(plates[i].z - plates[j].z);
      one ? hosts.offer(j, i, away) : hosts.offer(i, j, away);
    }
  };
  cloud::for_each_chunk(plates.size(), kChunk, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
    for_each_pair(places, begin, end, meet);
  });
  std::vector<std::uint32_t> part(plates.size());
  for (std::uint32_t i = 0; i < plates.size(); ++i) part[i] = sets.root(hosts.of(i));
  return part;
}

/// Parts of more height than one floor has, most of which is level: a ramp joins floors of its ends.
std::vector<bool> with_ramps(const std::vector<Plate>& plates, const std::vector<std::uint32_t>& part) {
  constexpr std::size_t kFewest = 400;  // cells: 2.4 m^2
  constexpr float kRise = 0.35F;        // m, between the lowest and the highest 5 %
  std::vector<std::vector<float>> heights(plates.size());
  for (std::size_t i = 0; i < plates.size(); ++i) heights[part[i]].push_back(plates[i].z);
  std::vector<bool> tall(plates.size());
  for (std::size_t p = 0; p < heights.size(); ++p) {
    const std::size_t n = heights[p].size(), low = n / 20, high = n - 1 - low;
    if (n < kFewest) continue;
    std::sort(heights[p].begin(), heights[p].end());
    tall[p] = heights[p][high] - heights[p][low] > kRise;
  }
  return tall;
}

/// Sums over the neighbours of a plate, from which its slope follows.
struct SlopeSums {
  double xx = 0, xy = 0, yy = 0, xz = 0, yz = 0, n = 0;
  /// In m per cell; 0 where the neighbours lie in a row.
  double steepness() const {
    const double det = xx * yy - xy * xy;
    if (n < 8 || det < 1e-3 * xx * yy) return 0;
    return std::hypot(yy * xz - xy * yz, xx * yz - xy * xz) / det;
  }
};

/// Plates on the ramps of parts that have some; none where a part is mostly steep, as of a street on a hill.
std::vector<bool> on_ramps(const std::vector<Plate>& plates, const Places& places,
                           const std::vector<std::uint32_t>& part, double cell) {
  constexpr double kSteep = 0.05, kMaxSteep = 0.4;  // m per m; of the part's plates
  const std::vector<bool> tall = with_ramps(plates, part);
  std::vector<bool> steep(plates.size());
  if (std::none_of(tall.begin(), tall.end(), [](bool is) { return is; })) return steep;
  std::vector<SlopeSums> sums(plates.size());
  for_each_pair(places, 0, plates.size(), [&](std::uint32_t i, std::uint32_t j) {
    if (part[i] != part[j] || !tall[part[i]]) return;
    const double dx = plates[j].x - plates[i].x, dy = plates[j].y - plates[i].y,
                 dz = static_cast<double>(plates[j].z - plates[i].z);
    for (const std::uint32_t k : {i, j}) {  // the reversed difference has the same products
      SlopeSums& of = sums[k];
      of.xx += dx * dx, of.xy += dx * dy, of.yy += dy * dy, of.xz += dx * dz, of.yz += dy * dz, ++of.n;
    }
  });
  std::vector<std::size_t> all(plates.size()), inclined(plates.size());
  for (std::size_t i = 0; i < plates.size(); ++i) {
    steep[i] = sums[i].steepness() > kSteep * cell;
    ++all[part[i]], inclined[part[i]] += steep[i] ? 1 : 0;
  }
  for (std::size_t i = 0; i < plates.size(); ++i)
    steep[i] =
        steep[i] && static_cast<double>(inclined[part[i]]) < kMaxSteep * static_cast<double>(all[part[i]]);
  return steep;
}

}  // namespace

bool by_place(const Plate& a, const Plate& b) {
  const std::int64_t one = cell_key(a.x, a.y), other = cell_key(b.x, b.y);
  return one != other ? one < other : a.z < b.z;
}

std::vector<std::uint32_t> join_plates(const std::vector<Plate>& plates, double cell) {
  const Places places(plates);
  const std::vector<std::uint32_t> part = components(plates, places, std::vector<bool>(plates.size()));
  const std::vector<bool> ramps = on_ramps(plates, places, part, cell);
  if (std::none_of(ramps.begin(), ramps.end(), [](bool is) { return is; })) return part;
  return components(plates, places, ramps);
}

}  // namespace parhelion::semantic
