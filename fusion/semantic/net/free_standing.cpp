#include "fusion/semantic/net/free_standing.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "fusion/semantic/net/wall_storeys.hpp"
#include "protocols/nearest_on_segment.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kFree = 0.4;  ///< m, from its top to the ceiling: walls that end nearer are extended to it
constexpr double kSameTop = 0.2;                    ///< m, between the tops of two faces
constexpr double kThinnest = 0.2, kThickest = 1.4;  ///< m: two shelves back to back; thinner is a partition
constexpr double kParallel = 0.1;                   ///< rad
constexpr double kAlike = 0.7;                      ///< of either face, that is opposite the other
constexpr double kFreeStanding = 12;                ///< of the score

/// The strip half way between two faces, over their common length.
struct Middle {
  Eigen::Vector2d start = Eigen::Vector2d::Zero(), along = Eigen::Vector2d::UnitX();  ///< m; unit
  double length = 0, half_width = 0;                                                  ///< m
};

bool ends_below_ceiling(const WallCandidate& wall) {
  return wall.curve == kNoCurve && wall.ceiling - wall.z_high > kFree;
}

/// Nothing where less than `min_length` (m) of them is parallel, or they are too near or too far.
Middle middle_of(const WallCandidate& a, const WallCandidate& b, double min_length) {
  if (std::abs(std::remainder(a.yaw() - b.yaw(), EIGEN_PI)) > kParallel) return {};
  const Eigen::Vector2d along = (a.end - a.start).normalized(), across(-along.y(), along.x());
  const double apart = across.dot(0.5 * (b.start + b.end) - a.start);
  if (std::abs(apart) < kThinnest || std::abs(apart) > kThickest) return {};
  const auto [low, high] = std::minmax({along.dot(b.start - a.start), along.dot(b.end - a.start)});
  const double from = std::max(low, 0.0), to = std::min(high, a.length());
  if (to - from < min_length) return {};
  return {a.start + from * along + apart / 2 * across, along, to - from, std::abs(apart) / 4};
}

/// Whether the ceiling goes on over the strip, with room between it and the things' top, and no floor lies
/// under it: then it would be an aisle.
bool is_free(const PlanPoints& points, const Middle& middle, const WallCandidate& wall) {
  constexpr double kBin = 0.25, kNear = 0.12, kOver = 0.1;                  // m
  constexpr double kMinCeiling = 0.6, kMaxBetween = 0.2, kMaxFloor = 0.85;  // of the strip's length
  const auto bins = static_cast<std::size_t>(std::ceil(middle.length / kBin));
  std::vector<bool> ceiling(bins), between(bins), floor(bins);
  const Eigen::Vector2d across(-middle.along.y(), middle.along.x());
  const Eigen::Vector2d end = middle.start + middle.length * middle.along;
  points.near_segment(middle.start, end, middle.half_width, [&](const PlanPoints::Point& point) {
    const Eigen::Vector2d d = point.p.head<2>().cast<double>() - middle.start;
    const double s = middle.along.dot(d), z = static_cast<double>(point.p.z());
    if (s < 0 || s >= middle.length || std::abs(across.dot(d)) > middle.half_width) return;
    const auto bin = std::min(bins - 1, static_cast<std::size_t>(s / kBin));
    if (std::abs(z - wall.ceiling) < kNear) ceiling[bin] = true;
    if (z > wall.z_high + kOver && z < wall.ceiling - kOver - kNear) between[bin] = true;
    if (std::abs(z - wall.floor) < kNear) floor[bin] = true;
  });
  const auto fraction = [&](const std::vector<bool>& of) {
    return static_cast<double>(std::count(of.begin(), of.end(), true)) / static_cast<double>(bins);
  };
  return fraction(ceiling) > kMinCeiling && fraction(between) < kMaxBetween && fraction(floor) < kMaxFloor;
}

/// Whether the ceiling over it and the floor go on at both its sides: over a wall whose top was not seen, the
/// ceiling ends. The next aisle but one counts, as things hide the floor of the nearest.
bool stands_in_room(const PlanPoints& points, const WallCandidate& wall) {
  constexpr double kBin = 0.25, kNear = 0.12;                 // m
  constexpr double kFrom = 0.1, kCeilingTo = 0.5, kTo = 3.0;  // m, beside its plane
  constexpr double kMinCeiling = 0.5, kMinFloor = 0.25;       // of its length
  const auto bins = static_cast<std::size_t>(std::ceil(wall.length() / kBin));
  std::array<std::vector<bool>, 4> seen;  // ceiling, floor on either side
  seen.fill(std::vector<bool>(bins));
  const Eigen::Vector2d along = (wall.end - wall.start).normalized(), across(-along.y(), along.x());
  points.near_segment(wall.start, wall.end, kTo, [&](const PlanPoints::Point& point) {
    const Eigen::Vector2d d = point.p.head<2>().cast<double>() - wall.start;
    const double s = along.dot(d), off = across.dot(d), z = static_cast<double>(point.p.z());
    if (s < 0 || s >= wall.length() || std::abs(off) < kFrom) return;
    const auto bin = std::min(bins - 1, static_cast<std::size_t>(s / kBin));
    const std::size_t side = off > 0 ? 1 : 0;
    if (std::abs(z - wall.ceiling) < kNear && std::abs(off) < kCeilingTo) seen[side][bin] = true;
    if (std::abs(z - wall.floor) < kNear && std::abs(off) < kTo) seen[2 + side][bin] = true;
  });
  const auto fraction = [&](const std::vector<bool>& of) {
    return static_cast<double>(std::count(of.begin(), of.end(), true)) / static_cast<double>(bins);
  };
  return std::min(fraction(seen[0]), fraction(seen[1])) > kMinCeiling &&
         std::min(fraction(seen[2]), fraction(seen[3])) > kMinFloor;
}

/// Whether one of its ends meets a wall: another surface across it that is longer than the end of a shelf, or
/// any that reaches the ceiling.
bool joins_wall(const std::vector<WallCandidate>& walls, const WallCandidate& wall) {
  constexpr double kJoin = 0.35, kAlike = 0.3;  // m, rad
  const auto near = [&](const Eigen::Vector2d& p, const WallCandidate& other) {
    return (nearest_on_segment(p, other.start, other.end) - p).norm() < kJoin;
  };
  return std::any_of(walls.begin(), walls.end(), [&](const WallCandidate& other) {
    if (&other == &wall || other.score <= 0 || other.whole_length() < kThickest) return false;
    const bool beyond = std::abs(std::remainder(other.yaw() - wall.yaw(), EIGEN_PI)) > kAlike;
    return (beyond || !ends_below_ceiling(other)) && (near(wall.start, other) || near(wall.end, other));
  });
}

/// m, up to which it is measured along more than the width of a pillar in line with it.
double solid_top(const WallCandidate& wall) {
  constexpr double kBand = 0.1, kUnderCeiling = 0.2, kSolid = 0.3;  // m; of a band's cells
  for (double z = wall.ceiling - kUnderCeiling; z > wall.floor + kBand; z -= kBand) {
    if (wall.raster.fractions(0, wall.raster.columns, z - kBand, z).measured > kSolid)
      return std::min(z, wall.z_high);
  }
  return wall.floor;
}

/// What is no higher than shelves and lockers, ends free under the ceiling and joins no wall.
std::vector<std::size_t> low_loners(const PlanPoints& points, const std::vector<WallCandidate>& walls) {
  constexpr double kHighest = 2.5;  // m over the floor
  std::vector<std::size_t> loners;
  for (std::size_t w = 0; w < walls.size(); ++w) {
    const WallCandidate& wall = walls[w];
    if (wall.curve != kNoCurve || wall.score < -kFreeStanding) continue;
    const double top = solid_top(wall);
    if (wall.ceiling - top > kFree && top - wall.floor < kHighest && !joins_wall(walls, wall) &&
        stands_in_room(points, wall))
      loners.push_back(w);
  }
  return loners;
}

}  // namespace

void weigh_free_standing(const PlanPoints& points, std::vector<WallCandidate>& walls) {
  const auto is_thing = [&](const WallCandidate& face, const WallCandidate& other, double min_length) {
    const Middle middle = middle_of(face, other, min_length);
    return middle.length > 0 && is_free(points, middle, face);
  };
  std::vector<bool> free(walls.size());
  for (std::size_t a = 0; a < walls.size(); ++a) {
    if (!ends_below_ceiling(walls[a])) continue;
    for (std::size_t b = 0; b < walls.size() && !free[a]; ++b) {
      const WallCandidate &face = walls[a], &other = walls[b];
      if (b == a || other.curve != kNoCurve || !on_same_storey(face, other)) continue;
      if (!ends_below_ceiling(other)) {  // a wall behind it
        free[a] = other.score > 0 && std::abs(other.ceiling - face.ceiling) < kSameTop &&
                  is_thing(face, other, kAlike * face.length());
      } else if (std::abs(face.z_high - other.z_high) < kSameTop) {
        free[a] = is_thing(face, other, kAlike * std::max(face.length(), other.length()));
      }
    }
  }
  for (std::size_t w = 0; w < walls.size(); ++w) {
    walls[w].free_standing = free[w];
    walls[w].score -= free[w] ? kFreeStanding : 0;
  }
  for (const std::size_t w : low_loners(points, walls)) {
    walls[w].free_standing = true;
    walls[w].score -= kFreeStanding;
  }
}

}  // namespace parhelion::semantic
