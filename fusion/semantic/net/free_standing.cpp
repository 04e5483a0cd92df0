#include "fusion/semantic/net/free_standing.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/semantic/net/wall_storeys.hpp"

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
}

}  // namespace parhelion::semantic
