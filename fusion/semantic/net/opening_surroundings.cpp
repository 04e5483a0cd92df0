#include "fusion/semantic/net/opening_surroundings.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/cloud/floor_index.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kAtWall = 0.05, kBeyond = 0.4;  ///< m across the wall: floor before and behind it
constexpr double kNicheBack = 0.8;               ///< m behind the wall's face, at most
constexpr double kOfFloor = 0.06;                ///< m over or under the floor's height
constexpr double kClear = 0.08, kShelf = 0.25;   ///< m before the wall: inside what stands there
constexpr double kLow = 0.5, kTall = 1.2;        ///< m under and over the floor: steps, kerbs, tables
constexpr int kBesideOpening = 12;               ///< columns

double fraction_of(const std::vector<bool>& marks, int from, int to) {
  return from >= to
             ? 0
             : static_cast<double>(std::count(marks.begin() + from, marks.begin() + to, true)) / (to - from);
}

/// Marks what was measured around an opening, by column and row.
class Marks {
 public:
  Marks(const PlanPoints& points, const WallCandidate& wall, int c0, int c1, double low, double high)
      : points_(points), wall_(wall), raster_(wall.raster), first_(c0 - kBesideOpening), columns_(c1 - c0) {
    row_ = std::max(raster_.row_of(low + 0.5 * raster_.row), 0);
    rows_ = std::max(std::min(raster_.row_of(high + 0.5 * raster_.row), raster_.rows) - row_, 0);
    lowest_ = std::min(wall.floor - kLow, raster_.z_low + row_ * raster_.row);
    highest_ = std::max(wall.floor + kTall, raster_.z_low + (row_ + rows_) * raster_.row);
    behind_.resize(static_cast<std::size_t>(columns_ + 2 * kBesideOpening));
    before_.resize(behind_.size());
    low_.resize(behind_.size());
    niche_.resize(static_cast<std::size_t>(columns_ * rows_));
  }

  void add(const PlanPoints::Point& point) {
    const double z = point.p.z();
    if (z < lowest_ || z > highest_) return;
    const Eigen::Vector2d d = point.p.head<2>().cast<double>() - raster_.start;
    const double offset = raster_.away.dot(d);
    if (std::abs(offset) < kAtWall || offset < -kBeyond || offset > kNicheBack) return;
    const int c = cloud::floor_index(raster_.along.dot(d) / raster_.column) - first_;
    if (c < 0 || c >= columns_ + 2 * kBesideOpening) return;
    if (std::abs(z - wall_.floor) < kOfFloor && offset < kBeyond)
      (offset < 0 ? before_ : behind_)[static_cast<std::size_t>(c)] = true;
    if (offset < -kClear && offset > -kShelf && z > wall_.floor - kLow && z < wall_.floor + kTall)
      low_[static_cast<std::size_t>(c)] = true;
    const int r = cloud::floor_index((z - raster_.z_low) / raster_.row) - row_, in = c - kBesideOpening;
    if (offset > kBeyond && in >= 0 && in < columns_ && r >= 0 && r < rows_ && seen_from_before(point))
      niche_[static_cast<std::size_t>(r * columns_ + in)] = true;
  }

  OpeningSurroundings result() const {
    const int from = kBesideOpening, to = kBesideOpening + columns_;
    const auto beside = [&](const std::vector<bool>& marks) {
      return std::max(fraction_of(marks, 0, from), fraction_of(marks, to, to + kBesideOpening));
    };
    return {fraction_of(behind_, from, to),
            fraction_of(before_, from, to),
            beside(before_),
            fraction_of(low_, from, to),
            beside(low_),
            fraction_of(niche_, 0, columns_ * rows_)};
  }

 private:
  bool seen_from_before(const PlanPoints::Point& point) const {
    if (point.viewpoint < 0) return true;
    const Eigen::Vector3f& eye = points_.viewpoints()[static_cast<std::size_t>(point.viewpoint)];
    return raster_.away.dot(eye.head<2>().cast<double>() - raster_.start) < 0;
  }

  const PlanPoints& points_;
  const WallCandidate& wall_;
  const WallRaster& raster_;
  int first_, columns_, row_ = 0, rows_ = 0;
  double lowest_ = 0, highest_ = 0;  ///< m, heights of points that matter
  std::vector<bool> behind_, before_, low_, niche_;
};

}  // namespace

OpeningSurroundings surroundings_of(const PlanPoints& points, const WallCandidate& wall, int c0, int c1,
                                    double low, double high) {
  const WallRaster& raster = wall.raster;
  Marks marks(points, wall, c0, c1, low, high);
  points.near_segment(raster.start + (c0 - kBesideOpening) * raster.column * raster.along,
                      raster.start + (c1 + kBesideOpening) * raster.column * raster.along, kNicheBack,
                      [&](const PlanPoints::Point& point) { marks.add(point); });
  return marks.result();
}

bool is_behind_furniture(const OpeningSurroundings& around) {
  constexpr double kFew = 0.3, kMany = 0.6;
  return around.floor_before < kFew && around.floor_beside > kMany && around.low_before < kFew &&
         around.low_beside > kMany;
}

}  // namespace parhelion::semantic
