#include "fusion/semantic/net/floating_flights.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kSame = 0.12;        ///< m, height of a floor and of a flight's foot on it
constexpr double kBeside = 0.6;       ///< m, a floor's bounds reach this far
constexpr double kUsualTread = 0.28;  ///< m

/// The edge of the lowest step, in its middle.
struct Foot {
  Eigen::Vector2d p = Eigen::Vector2d::Zero();   ///< m
  double z = 0, rise = 0, tread = 0, width = 0;  ///< m
};

Foot foot_of(const Flight& flight) {
  const Step& first = flight.steps[1];
  const Eigen::Vector2d across(-flight.direction.y(), flight.direction.x());
  Foot foot;
  foot.p = first.near * flight.direction + 0.5 * (first.left + first.right) * across;
  foot.z = flight.steps[0].z;
  foot.rise = median(flight.rises());
  std::vector<double> treads = flight.treads();
  foot.tread = treads.empty() ? kUsualTread : median(treads);
  foot.width = first.right - first.left;
  return foot;
}

/// The highest floor about the foot that is not above it; nullopt: none was found.
std::optional<double> floor_at(const Segmentation& segmentation, const Levels& levels, const Foot& foot) {
  std::optional<double> best;
  for (std::size_t h = 0; h < segmentation.horizontals.size(); ++h) {
    const HorizontalSurface& s = segmentation.horizontals[h];
    const bool beside =
        (foot.p.array() > s.low.array() - kBeside).all() && (foot.p.array() < s.high.array() + kBeside).all();
    if (beside && levels.floor_score(h) > 0 && s.z < foot.z + kSame && (!best || s.z > *best)) best = s.z;
  }
  return best;
}

/// Fraction of the way down from the foot, as long as the steps that are missing above `floor`, on which a
/// height (m) was measured.
double measured_before(const PlanPoints& points, const Flight& flight, const Foot& foot, double length,
                       double z) {
  constexpr double kBin = 0.1, kNear = 0.06;  // m
  const auto bins = static_cast<std::size_t>(std::ceil(length / kBin));
  std::vector<bool> seen(bins);
  const Eigen::Vector2d across(-flight.direction.y(), flight.direction.x());
  points.near_segment(foot.p, foot.p - length * flight.direction, foot.width / 4,
                      [&](const PlanPoints::Point& point) {
                        const Eigen::Vector2d d = point.p.head<2>().cast<double>() - foot.p;
                        const double s = -flight.direction.dot(d);
                        if (s < 0 || s >= length || std::abs(across.dot(d)) > foot.width / 4 ||
                            std::abs(static_cast<double>(point.p.z()) - z) > kNear)
                          return;
                        seen[std::min(bins - 1, static_cast<std::size_t>(s / kBin))] = true;
                      });
  return static_cast<double>(std::count(seen.begin(), seen.end(), true)) / static_cast<double>(bins);
}

/// Whether the floor was measured where the steps would be that are missing between it and the flight. Steps
/// deeper than two usual ones are terraces: of these not even a hidden part is long, and boxes in a rack lie
/// like them.
bool is_floating(const PlanPoints& points, const Segmentation& segmentation, const Levels& levels,
                 const Flight& flight) {
  constexpr double kMinFraction = 0.8, kFarthest = 5;  // of the way; m
  constexpr double kMaxHidden = 2.5;                   // rises of a terrace
  const Foot foot = foot_of(flight);
  const std::optional<double> floor = floor_at(segmentation, levels, foot);
  if (!floor || foot.z - *floor < kSame) return false;
  if (foot.tread > 2 * kUsualTread && foot.z - *floor > kMaxHidden * foot.rise) return true;
  const double missing = std::min((foot.z - *floor) / foot.rise * foot.tread, kFarthest);
  return measured_before(points, flight, foot, missing, *floor) > kMinFraction;
}

/// Fraction of a step's middle over which something lies too low to walk under: the step is a shelf, or the
/// underside of another flight.
double covered(const PlanPoints& points, const Eigen::Vector2d& direction, const Step& step) {
  constexpr double kBin = 0.1, kLow = 0.25, kHigh = 1.2;  // m
  const Eigen::Vector2d across(-direction.y(), direction.x());
  const double width = step.right - step.left, depth = step.far - step.near;
  const double left = step.left + width / 4, near = step.near + depth / 4;
  const auto columns = static_cast<std::size_t>(std::ceil(width / 2 / kBin));
  std::vector<bool> over(columns);
  const double s = 0.5 * (step.near + step.far);
  points.near_segment(s * direction + left * across, s * direction + (left + width / 2) * across, depth / 4,
                      [&](const PlanPoints::Point& point) {
                        const Eigen::Vector2d p = point.p.head<2>().cast<double>();
                        const double z = static_cast<double>(point.p.z()) - step.z;
                        const double u = direction.dot(p) - near, t = across.dot(p) - left;
                        if (z < kLow || z > kHigh || u < 0 || u > depth / 2 || t < 0 || t >= width / 2)
                          return;
                        over[std::min(columns - 1, static_cast<std::size_t>(t / kBin))] = true;
                      });
  return static_cast<double>(std::count(over.begin(), over.end(), true)) / static_cast<double>(columns);
}

bool has_no_headroom(const PlanPoints& points, const Flight& flight) {
  constexpr double kCovered = 0.5;  // of a step, and of the steps
  double steps = 0;
  for (std::size_t i = 1; i < flight.steps.size(); ++i) {
    steps += covered(points, flight.direction, flight.steps[i]) > kCovered ? 1 : 0;
  }
  return steps > kCovered * static_cast<double>(flight.steps.size() - 1);
}

/// Whether a flight of three steps has treads of different depths: steps are even.
bool is_uneven(const Flight& flight) {
  constexpr double kAlike = 2;
  const std::vector<double> treads = flight.treads();
  if (treads.size() != 2) return false;
  const auto [low, high] = std::minmax(treads[0], treads[1]);
  return high > kAlike * low;
}

}  // namespace

void drop_floating(const PlanPoints& points, const Segmentation& segmentation, const Levels& levels,
                   std::vector<Flight>& flights) {
  std::erase_if(flights, [&](const Flight& flight) {
    return is_uneven(flight) || is_floating(points, segmentation, levels, flight) ||
           has_no_headroom(points, flight);
  });
}

}  // namespace parhelion::semantic
