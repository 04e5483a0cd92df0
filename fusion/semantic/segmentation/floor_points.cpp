#include "fusion/semantic/segmentation/floor_points.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <span>
#include <unordered_map>

#include "protocols/model.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kCell = 0.2;       // m, of the plan
constexpr int kReach = 3;           // cells: bridges the gaps between a scanner's lines at long range
constexpr double kUneven = 0.015;   // m
constexpr double kSlope = 0.06;     // m of height per metre of distance
constexpr double kOver = 0.15;      // m, over the floor where it began
constexpr double kUnder = 0.5;      // m, under it
constexpr double kSkin = 0.04;      // m, band around a cell's height
constexpr std::uint32_t kSeed = 3;  // minimum floor points of a cell that seeds the growth
constexpr int kBeside = 5;          // cells: half of a low thing is not wider
constexpr double kLow = 0.03;       // m, over the floor on both sides: a doormat is lower
constexpr int kClose = 2;           // cells
constexpr double kSteep = 0.045;    // m, over a floor so close

bool is(std::uint8_t label, EntityLabel kind) { return label == static_cast<std::uint8_t>(kind); }

/// Points of one scan that may belong to its floor, by plan cell.
class ScanFloor {
 public:
  ScanFloor(const cloud::PointCloud<Map>& cloud, std::span<const std::uint32_t> points) : cloud_(cloud) {
    std::uint32_t last = 0;  // the next point is often in the same cell
    for (const std::uint32_t i : points) {
      const std::uint64_t key = key_of(cloud.points[i]);
      if (cells_.empty() || cells_[last].key != key) {
        const auto [at, is_new] = index_.emplace(key, static_cast<std::uint32_t>(cells_.size()));
        if (is_new) cells_.push_back({key, {}, 0, 0, false, false});
        last = at->second;
      }
      cells_[last].points.push_back(i);
    }
  }

  void grow(std::vector<std::uint8_t>& labels) {
    begin(labels);
    while (!open_.empty()) {
      const std::uint32_t from = open_.front();
      open_.pop_front();
      for (int dy = -kReach; dy <= kReach; ++dy) {
        for (int dx = -kReach; dx <= kReach; ++dx) reach(from, dx, dy);
      }
    }
    for (const Cell& cell : cells_) {
      if (!cell.reached || stands_out(cell)) continue;
      for (const std::uint32_t i : cell.points) {
        if (is(labels[i], EntityLabel::unknown) && std::abs(cloud_.points[i].z() - cell.z) <= kSkin)
          labels[i] = static_cast<std::uint8_t>(EntityLabel::floor);
      }
    }
  }

 private:
  struct Cell {
    std::uint64_t key;
    std::vector<std::uint32_t> points;
    double z, begun;  // m, height of the floor here, and where it began
    bool reached, seed;
  };
  static std::uint64_t key_of(int x, int y) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32 | static_cast<std::uint32_t>(y);
  }
  static std::uint64_t key_of(const Eigen::Vector3f& p) {
    const auto cell = [](float v) { return static_cast<int>(std::floor(v / kCell)); };
    return key_of(cell(p.x()), cell(p.y()));
  }
  /// m, mean height of the cell's points that lie within `window` of z; NaN: none.
  double mean_near(const Cell& cell, double z, double window) const {
    double sum = 0, count = 0;
    for (const std::uint32_t i : cell.points) {
      const double at = cloud_.points[i].z();
      if (std::abs(at - z) > window) continue;
      sum += at;
      count += 1;
    }
    return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
  }
  void begin(const std::vector<std::uint8_t>& labels) {
    for (std::uint32_t c = 0; c < cells_.size(); ++c) {
      double sum = 0;
      std::uint32_t count = 0;
      for (const std::uint32_t i : cells_[c].points) {
        if (!is(labels[i], EntityLabel::floor)) continue;
        sum += cloud_.points[i].z();
        ++count;
      }
      if (count < kSeed) continue;
      cells_[c].z = cells_[c].begun = sum / count;
      cells_[c].reached = cells_[c].seed = true;
      open_.push_back(c);
    }
  }
  /// nullptr: no points are there.
  const Cell* find(const Cell& from, int dx, int dy) const {
    const auto x = static_cast<int>(static_cast<std::uint32_t>(from.key >> 32)) + dx;
    const auto y = static_cast<int>(static_cast<std::uint32_t>(from.key)) + dy;
    const auto found = index_.find(key_of(x, y));
    return found == index_.end() ? nullptr : &cells_[found->second];
  }
  /// m, of the nearest of so many cells in that direction where the growth began; infinite: none. A floor
  /// below a kerb or a landing is another one.
  double floor_beside(const Cell& from, int dx, int dy, int cells) const {
    for (int k = 1; k <= cells; ++k) {
      const Cell* cell = find(from, k * dx, k * dy);
      const double lowest = from.begun - kUneven - kSlope * k * kCell * std::hypot(dx, dy);
      if (cell != nullptr && cell->seed && cell->z > lowest) return cell->z;
    }
    return std::numeric_limits<double>::infinity();
  }
  /// Whether the floor lies lower on both its sides, or close by: a low thing with flanks that the growth has
  /// climbed. A floor bows more gently, and mostly at the far end of a scan.
  bool stands_out(const Cell& cell) const {
    constexpr std::array<std::array<int, 2>, 4> kAcross = {{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
    return !cell.seed && std::any_of(kAcross.begin(), kAcross.end(), [&](const auto& d) {
      const auto beside = [&](int cells) {
        return std::minmax({floor_beside(cell, d[0], d[1], cells), floor_beside(cell, -d[0], -d[1], cells)});
      };
      return cell.z > beside(kBeside).second + kLow || cell.z > beside(kClose).first + kSteep;
    });
  }
  void reach(std::uint32_t from, int dx, int dy) {
    const Cell* found = find(cells_[from], dx, dy);
    if (found == nullptr || found->reached) return;
    const auto at = static_cast<std::uint32_t>(found - cells_.data());
    Cell& cell = cells_[at];
    const double distance = kCell * std::hypot(dx, dy);
    const double z = mean_near(cell, cells_[from].z, kUneven + kSlope * distance);
    const double begun = cells_[from].begun;
    if (!(z <= begun + kOver && z >= begun - kUnder)) return;
    cell.z = z;
    cell.begun = begun;
    cell.reached = true;
    open_.push_back(at);
  }

  const cloud::PointCloud<Map>& cloud_;
  std::unordered_map<std::uint64_t, std::uint32_t> index_;
  std::vector<Cell> cells_;
  std::deque<std::uint32_t> open_;
};

}  // namespace

void grow_floors(const cloud::PointCloud<Map>& cloud, std::vector<std::uint8_t>& labels) {
  float lowest = std::numeric_limits<float>::max(), highest = std::numeric_limits<float>::lowest();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!is(labels[i], EntityLabel::floor)) continue;
    lowest = std::min(lowest, cloud.points[i].z());
    highest = std::max(highest, cloud.points[i].z());
  }
  if (!(lowest <= highest)) return;
  const auto low = lowest - static_cast<float>(kUnder), high = highest + static_cast<float>(kOver);
  // By scan, in the order of the points.
  std::vector<std::vector<std::uint32_t>> of_scan(std::max<std::size_t>(1, cloud.viewpoints.size()));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const bool may_be = is(labels[i], EntityLabel::floor) || is(labels[i], EntityLabel::unknown);
    if (!may_be || cloud.points[i].z() < low || cloud.points[i].z() > high) continue;
    const std::size_t scan = cloud.scans.empty() ? 0 : cloud.scans[i];
    if (scan >= of_scan.size()) of_scan.resize(scan + 1);
    of_scan[scan].push_back(static_cast<std::uint32_t>(i));
  }
  // Each scan changes the labels of its own points only.
  tbb::parallel_for(std::size_t{0}, of_scan.size(), [&](std::size_t scan) {
    ScanFloor(cloud, of_scan[scan]).grow(labels);
    of_scan[scan] = {};
  });
}

}  // namespace parhelion::semantic
