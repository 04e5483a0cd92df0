#include "fusion/semantic/net/judged_top.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace parhelion::semantic {
namespace {

constexpr double kFrom = 0.12;      ///< m beside its plane, where its own points end
constexpr double kBeyond = 1.0;     ///< m: where nothing is measured so far behind it, the site ends
constexpr double kThin = 0.45;      ///< m, from one face to the floor behind the other
constexpr double kLevel = 0.1;      ///< m, of the floor
constexpr double kNothing = 0.1;    ///< of its columns that have points beyond it
constexpr double kFloor = 0.5;      ///< of its columns that have floor
constexpr double kBelow = 0.4;      ///< m, from its top to the ceiling
constexpr double kPartition = 1.9;  ///< m, least height of a partition: cubicles of a washroom
constexpr double kLow = 0.8;        ///< m: what is lower bounds no site
constexpr double kShortest = 1.2;   ///< m: leaves of doors are shorter

struct Sides {
  bool end_of_site = false, floor_on_both = false;
};

Sides sides_of(const PlanPoints& points, const WallCandidate& wall) {
  const auto columns = static_cast<std::size_t>(wall.raster.columns);
  std::array<std::vector<bool>, 2> any, floor;  // per side
  any.fill(std::vector<bool>(columns)), floor.fill(std::vector<bool>(columns));
  points.near_segment(wall.start, wall.end, kBeyond, [&](const PlanPoints::Point& point) {
    const Eigen::Vector2d d = point.p.head<2>().cast<double>() - wall.start;
    const double offset = wall.raster.away.dot(d), at = wall.raster.along.dot(d) / wall.raster.column;
    if (at < 0 || at >= wall.raster.columns || std::abs(offset) < kFrom || std::abs(offset) > kBeyond) return;
    const std::size_t side = offset > 0 ? 1 : 0, column = static_cast<std::size_t>(at);
    any[side][column] = true;
    if (std::abs(offset) < kThin && std::abs(static_cast<double>(point.p.z()) - wall.floor) < kLevel)
      floor[side][column] = true;
  });
  const auto fraction = [&](const std::vector<bool>& of) {
    return static_cast<double>(std::count(of.begin(), of.end(), true)) / static_cast<double>(columns);
  };
  return {std::min(fraction(any[0]), fraction(any[1])) < kNothing,
          std::min(fraction(floor[0]), fraction(floor[1])) > kFloor};
}

}  // namespace

double judged_top(const PlanPoints& points, const WallCandidate& wall) {
  const double top = wall.z_high - wall.floor;
  if (wall.ceiling - wall.z_high < kBelow || top < kLow || wall.whole_length() < kShortest)
    return wall.ceiling;
  const Sides sides = sides_of(points, wall);
  return sides.end_of_site || (sides.floor_on_both && top > kPartition) ? wall.z_high : wall.ceiling;
}

}  // namespace parhelion::semantic
