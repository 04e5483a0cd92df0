#include "fusion/semantic/net/levels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kCell = 0.25;          ///< m, plan cell for the lowest and highest point
constexpr double kSame = 0.15;          ///< m, heights that count as one level
constexpr double kMinRoomHeight = 1.9;  ///< m, from a floor to the ceiling over it
constexpr double kMinArea = 1.0;        ///< m^2, of a floor or a ceiling
constexpr double kBow = 0.12;           ///< m, height variation of one floor
constexpr double kPart = 3;             ///< deduction for a part of a larger level
constexpr double kBeside = 0.6;         ///< m, a level reaches this far beyond its bounds

/// Lowest and highest point of each plan cell.
struct Extremes {
  Eigen::Vector2f low = Eigen::Vector2f::Zero();
  Eigen::Vector2i cells = Eigen::Vector2i::Zero();
  std::vector<float> lowest, highest;

  explicit Extremes(const cloud::PointCloud<Map>& cloud) {
    Eigen::AlignedBox2f bounds;
    for (const Eigen::Vector3f& p : cloud.points) bounds.extend(p.head<2>());
    if (cloud.empty()) return;
    low = bounds.min();
    cells = ((bounds.max() - low) / static_cast<float>(kCell)).array().floor().cast<int>() + 1;
    const auto n = static_cast<std::size_t>(cells.x()) * static_cast<std::size_t>(cells.y());
    lowest.assign(n, std::numeric_limits<float>::max());
    highest.assign(n, std::numeric_limits<float>::lowest());
    for (const Eigen::Vector3f& p : cloud.points) {
      const std::size_t i = index(p);
      lowest[i] = std::min(lowest[i], p.z());
      highest[i] = std::max(highest[i], p.z());
    }
  }
  std::size_t index(const Eigen::Vector3f& p) const {
    const Eigen::Vector2i c = ((p.head<2>() - low) / static_cast<float>(kCell)).array().floor().cast<int>();
    return static_cast<std::size_t>(c.y()) * static_cast<std::size_t>(cells.x()) +
           static_cast<std::size_t>(c.x());
  }
};

bool beside(const HorizontalSurface& h, const Eigen::Vector2d& p) {
  return (p.array() > h.low.array() - kBeside).all() && (p.array() < h.high.array() + kBeside).all();
}

}  // namespace

Levels::Levels(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation)
    : segmentation_(segmentation) {
  const Extremes extremes(cloud);
  const std::size_t verticals = segmentation.verticals.size(), n = segmentation.horizontals.size();
  std::vector<double> points(n, 0);
  evidence_.resize(n);
  floor_part_.assign(n, 0);
  ceiling_part_.assign(n, 0);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::uint32_t surface = segmentation.surface_of[i];
    if (surface == kNoSurface || surface < verticals) continue;
    const std::size_t h = surface - verticals;
    const Eigen::Vector3f& p = cloud.points[i];
    const std::size_t cell = extremes.index(p);
    points[h] += 1;
    evidence_[h].lowest += p.z() - extremes.lowest[cell] < kSame ? 1 : 0;
    evidence_[h].highest += extremes.highest[cell] - p.z() < kSame ? 1 : 0;
  }
  std::vector<float> heights;
  for (std::size_t i = 0; i < cloud.size(); i += 1 + cloud.size() / 200'000)
    heights.push_back(cloud.points[i].z());
  if (!heights.empty()) top_ = quantile(heights, 0.995), floor_ = quantile(heights, 0.005);
  for (std::size_t h = 0; h < n; ++h) {
    if (points[h] > 0) evidence_[h].lowest /= points[h], evidence_[h].highest /= points[h];
  }
  find_parts();
  double floor_area = 0, ceiling_area = 0;
  for (std::size_t h = 0; h < n; ++h) {
    const double area = segmentation.horizontals[h].area;
    if (floor_score(h) > 0 && area > floor_area) {
      floor_area = area;
      floor_ = segmentation.horizontals[h].z;
      has_floor_ = true;
    }
  }
  for (std::size_t h = 0; h < n; ++h) {
    const HorizontalSurface& surface = segmentation.horizontals[h];
    if (ceiling_score(h) > 0 && surface.area > ceiling_area) {
      ceiling_area = surface.area;
      ceiling_ = surface.z;
    }
  }
}

void Levels::find_parts() {
  const std::vector<HorizontalSurface>& all = segmentation_.horizontals;
  for (std::size_t h = 0; h < all.size(); ++h) {
    const Eigen::Vector2d centre = 0.5 * (all[h].low + all[h].high);
    for (std::size_t g = 0; g < all.size(); ++g) {
      if (all[g].area < kPart * all[h].area || !beside(all[g], centre)) continue;
      const double over = all[h].z - all[g].z;
      if (!all[g].faces_down && over > 0 && over < kBow) floor_part_[h] = 2 * kPart;
      if (all[g].faces_down && over < 0 && over > -1.0) ceiling_part_[h] = 2 * kPart;
    }
  }
}

double Levels::floor_score(std::size_t i) const {
  const HorizontalSurface& h = segmentation_.horizontals[i];
  if (h.faces_down) return -4;
  return -floor_part_[i] + 8 * (evidence_[i].lowest - 0.6) + std::min(std::log(h.area / kMinArea), 1.5) -
         (evidence_[i].highest > 0.9 && h.z > floor_ + kMinRoomHeight && has_floor_ ? 3 : 0);
}

double Levels::ceiling_score(std::size_t i) const {
  const HorizontalSurface& h = segmentation_.horizontals[i];
  if (h.z < floor_ + kMinRoomHeight) return -6;
  return -ceiling_part_[i] + 6 * (evidence_[i].highest - 0.6) + std::min(std::log(h.area / kMinArea), 1.5) +
         (h.faces_down ? 1 : -2);
}

double Levels::over(const Eigen::Vector2d& p, double z_high) const {
  double best = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < segmentation_.horizontals.size(); ++i) {
    const HorizontalSurface& h = segmentation_.horizontals[i];
    if (ceiling_score(i) > 0 && h.z > z_high - 0.3 && h.z < best && beside(h, p)) best = h.z;
  }
  return best < std::numeric_limits<double>::max() ? best
         : ceiling_ && *ceiling_ > z_high - 0.3    ? *ceiling_
                                                   : std::max(top_, z_high);
}

double Levels::under(const Eigen::Vector2d& p, double z_low) const {
  double best = std::numeric_limits<double>::lowest();
  for (std::size_t i = 0; i < segmentation_.horizontals.size(); ++i) {
    const HorizontalSurface& h = segmentation_.horizontals[i];
    if (floor_score(i) > 0 && h.z < z_low + 0.4 && h.z > best && beside(h, p)) best = h.z;
  }
  return best > std::numeric_limits<double>::lowest() ? best : std::min(floor_, z_low);
}

}  // namespace parhelion::semantic
