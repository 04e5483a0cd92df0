#include "fusion/semantic/net/mirrored_walls.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::semantic {
namespace {

constexpr double kMirrored = 20;  // of the score

bool is_flat_wall(const WallCandidate& wall) { return wall.curve == kNoCurve && wall.score > 0; }

double angle_between(const WallCandidate& a, const WallCandidate& b) {
  return std::abs(std::remainder(a.yaw() - b.yaw(), EIGEN_PI));
}

/// m, signed, from a wall's plane.
double off(const WallCandidate& wall, const Eigen::Vector2d& p) {
  return wall.raster.away.dot(p - wall.start);
}

/// Whether the image of `wall` in the plane of `mirror` lies on `real`.
bool is_image(const WallCandidate& wall, const WallCandidate& mirror, const WallCandidate& real) {
  constexpr double kOff = 0.06, kOverlap = 0.5;  // m; of the image
  const auto image = [&](const Eigen::Vector2d& p) -> Eigen::Vector2d {
    return p - 2 * off(mirror, p) * mirror.raster.away;
  };
  const Eigen::Vector2d a = image(wall.start), b = image(wall.end);
  if (std::abs(off(real, a)) > kOff || std::abs(off(real, b)) > kOff) return false;
  const double s = real.raster.along.dot(a - real.start), t = real.raster.along.dot(b - real.start);
  return std::min(std::max(s, t), real.length()) - std::max(std::min(s, t), 0.0) > kOverlap * wall.length();
}

/// Whether the ray from `from` to `p` crosses a wall between its foot and its top.
bool crosses(const WallCandidate& wall, const Eigen::Vector3d& from, const Eigen::Vector3d& p) {
  constexpr double kFoot = 0.4;  // m: doors reach the floor, mirrors seldom
  const double before = off(wall, from.head<2>()), behind = off(wall, p.head<2>());
  if (before * behind >= 0) return false;
  const Eigen::Vector3d at = from + before / (before - behind) * (p - from);
  const double along = wall.raster.along.dot(at.head<2>() - wall.start);
  return along > 0 && along < wall.length() && at.z() > wall.floor + kFoot && at.z() < wall.ceiling;
}

struct Ray {
  Eigen::Vector3d from, p;  ///< m: the scanner, and what it measured
};

/// The rays that measured a wall between floor and ceiling.
std::vector<Ray> rays_to(const PlanPoints& points, const WallCandidate& wall) {
  constexpr double kNear = 0.05, kInside = 0.15;  // m
  std::vector<Ray> rays;
  const double length = wall.length(), low = wall.floor + kInside, high = wall.ceiling - kInside;
  points.near_segment(wall.start, wall.end, kNear, [&](const PlanPoints::Point& point) {
    const Eigen::Vector3d p = point.p.cast<double>();
    if (point.viewpoint < 0 || std::abs(off(wall, p.head<2>())) > kNear || p.z() < low || p.z() > high)
      return;
    const double along = wall.raster.along.dot(p.head<2>() - wall.start);
    if (along < 0 || along > length) return;
    rays.push_back({points.viewpoints()[static_cast<std::size_t>(point.viewpoint)].cast<double>(), p});
  });
  return rays;
}

/// Whether nearly all rays cross a wall. A few tell for most walls of a large site that they do not.
bool cross_it(const std::vector<Ray>& rays, const WallCandidate& wall) {
  constexpr double kMinFraction = 0.9;
  constexpr std::size_t kFew = 16;
  for (const std::size_t stride : {1 + rays.size() / kFew, std::size_t{1}}) {
    std::size_t all = 0, through = 0;
    for (std::size_t i = 0; i < rays.size(); i += stride) {
      ++all;
      through += crosses(wall, rays[i].from, rays[i].p) ? 1 : 0;
    }
    const double min_fraction = stride > 1 ? 0.5 : kMinFraction;
    if (static_cast<double>(through) <= min_fraction * static_cast<double>(all)) return false;
  }
  return true;
}

bool is_mirrored(const PlanPoints& points, const std::vector<WallCandidate>& walls,
                 const WallCandidate& wall) {
  constexpr double kOblique = 0.5;  // rad: walls across the mirror go on behind it as they do before it
  constexpr std::size_t kFewest = 50;
  const std::vector<Ray> rays = rays_to(points, wall);
  if (rays.size() < kFewest) return false;
  return std::any_of(walls.begin(), walls.end(), [&](const WallCandidate& mirror) {
    if (&mirror == &wall || !is_flat_wall(mirror) || angle_between(mirror, wall) > kOblique ||
        !cross_it(rays, mirror))
      return false;
    return std::any_of(walls.begin(), walls.end(), [&](const WallCandidate& real) {
      return &real != &wall && &real != &mirror && is_flat_wall(real) && is_image(wall, mirror, real);
    });
  });
}

}  // namespace

void weigh_mirrored(const PlanPoints& points, std::vector<WallCandidate>& walls) {
  if (!points.has_rays()) return;
  std::vector<std::size_t> mirrored;
  for (std::size_t w = 0; w < walls.size(); ++w) {
    if (is_flat_wall(walls[w]) && is_mirrored(points, walls, walls[w])) mirrored.push_back(w);
  }
  for (const std::size_t w : mirrored) walls[w].score -= kMirrored;
}

}  // namespace parhelion::semantic
