#include "fusion/semantic/net/mirrored_walls.hpp"

#include <oneapi/tbb/parallel_for.h>

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

constexpr double kFoot = 0.4;  ///< m: doors reach the floor, mirrors seldom

/// Whether the ray from `from` to `p` crosses a wall between `foot` (m over its floor) and its top.
bool crosses(const WallCandidate& wall, double foot, const Eigen::Vector3d& from, const Eigen::Vector3d& p) {
  const double before = off(wall, from.head<2>()), behind = off(wall, p.head<2>());
  if (before * behind >= 0) return false;
  const Eigen::Vector3d at = from + before / (before - behind) * (p - from);
  const double along = wall.raster.along.dot(at.head<2>() - wall.start);
  return along > 0 && along < wall.length() && at.z() > wall.floor + foot && at.z() < wall.ceiling;
}

/// The ends of the rays that measured a wall between floor and ceiling.
std::vector<PlanPoints::Point> rays_to(const PlanPoints& points, const WallCandidate& wall) {
  constexpr double kNear = 0.05, kInside = 0.15;  // m
  std::vector<PlanPoints::Point> rays;
  const double length = wall.length(), low = wall.floor + kInside, high = wall.ceiling - kInside;
  points.near_segment(wall.start, wall.end, kNear, [&](const PlanPoints::Point& point) {
    const Eigen::Vector3d p = point.p.cast<double>();
    if (point.viewpoint < 0 || std::abs(off(wall, p.head<2>())) > kNear || p.z() < low || p.z() > high)
      return;
    const double along = wall.raster.along.dot(p.head<2>() - wall.start);
    if (along < 0 || along > length) return;
    rays.push_back(point);
  });
  return rays;
}

/// Whether nearly all rays cross a wall. A few tell for most walls of a large site that they do not.
bool cross_it(const PlanPoints& points, const std::vector<PlanPoints::Point>& rays, const WallCandidate& wall,
              double foot = kFoot) {
  constexpr double kMinFraction = 0.9;
  constexpr std::size_t kFew = 16;
  for (const std::size_t stride : {1 + rays.size() / kFew, std::size_t{1}}) {
    std::size_t all = 0, through = 0;
    for (std::size_t i = 0; i < rays.size(); i += stride) {
      ++all;
      const Eigen::Vector3f& from = points.viewpoints()[static_cast<std::size_t>(rays[i].viewpoint)];
      through += crosses(wall, foot, from.cast<double>(), rays[i].p.cast<double>()) ? 1 : 0;
    }
    const double min_fraction = stride > 1 ? 0.5 : kMinFraction;
    if (static_cast<double>(through) <= min_fraction * static_cast<double>(all)) return false;
  }
  return true;
}

constexpr std::size_t kFewest = 50;  ///< rays

/// The mirror in which `wall` was seen; nullptr: in none.
const WallCandidate* mirror_of(const PlanPoints& points, const std::vector<WallCandidate>& walls,
                               const WallCandidate& wall) {
  constexpr double kOblique = 0.5;  // rad: walls across the mirror go on behind it as they do before it
  const std::vector<PlanPoints::Point> rays = rays_to(points, wall);
  if (rays.size() < kFewest) return nullptr;
  const auto found = std::find_if(walls.begin(), walls.end(), [&](const WallCandidate& mirror) {
    if (&mirror == &wall || !is_flat_wall(mirror) || angle_between(mirror, wall) > kOblique ||
        !cross_it(points, rays, mirror))
      return false;
    return std::any_of(walls.begin(), walls.end(), [&](const WallCandidate& real) {
      return &real != &wall && &real != &mirror && is_flat_wall(real) && is_image(wall, mirror, real);
    });
  });
  return found != walls.end() ? &*found : nullptr;
}

/// A wall in which another one was seen.
struct Mirror {
  WallCandidate wall;
  double side = 1;  ///< 1: images are in the direction `wall.raster.away`; -1: opposite to it
};

/// The part of a wall that lies behind a mirror's plane; of length 0 where there is none.
WallCandidate part_behind(const WallCandidate& wall, const Mirror& mirror) {
  constexpr double kBehind = 0.15, kShortest = 0.3;  // m
  const double a = mirror.side * off(mirror.wall, wall.start) - kBehind,
               b = mirror.side * off(mirror.wall, wall.end) - kBehind;
  WallCandidate part = wall;
  if (a * b < 0) (a < 0 ? part.start : part.end) = wall.start + a / (a - b) * (wall.end - wall.start);
  if (std::max(a, b) <= 0 || part.length() < kShortest) part.end = part.start;
  return part;
}

/// Leaves of a wall across a mirror the part before it.
void cut_at(const Mirror& mirror, WallCandidate& wall) {
  const double a = mirror.side * off(mirror.wall, wall.start), b = mirror.side * off(mirror.wall, wall.end);
  const Eigen::Vector2d at = wall.start + a / (a - b) * (wall.end - wall.start);
  (a > b ? wall.start : wall.end) = at;
}

}  // namespace

std::vector<std::size_t> weigh_mirrored(const PlanPoints& points, std::vector<WallCandidate>& walls) {
  constexpr double kWhole = 0.95;       // of a wall's length
  constexpr double kMirrorFoot = 0.05;  // m: of what is known to be a mirror
  std::vector<std::size_t> shortened;
  if (!points.has_rays()) return shortened;
  std::vector<Mirror> mirrors;
  std::vector<bool> mirrored(walls.size());
  std::vector<const WallCandidate*> mirror_of_wall(walls.size(), nullptr);
  tbb::parallel_for(std::size_t{0}, walls.size(), [&](std::size_t w) {
    if (is_flat_wall(walls[w])) mirror_of_wall[w] = mirror_of(points, walls, walls[w]);
  });
  for (std::size_t w = 0; w < walls.size(); ++w) {
    if (mirror_of_wall[w] == nullptr) continue;
    mirrored[w] = true;
    mirrors.push_back({*mirror_of_wall[w],
                       off(*mirror_of_wall[w], 0.5 * (walls[w].start + walls[w].end)) > 0 ? 1.0 : -1.0});
  }
  // Of walls across a mirror the part behind it is seen through it only.
  for (const Mirror& mirror : mirrors) {
    for (std::size_t w = 0; w < walls.size(); ++w) {
      if (mirrored[w] || !is_flat_wall(walls[w])) continue;
      const WallCandidate part = part_behind(walls[w], mirror);
      if (part.length() <= 0) continue;
      const std::vector<PlanPoints::Point> rays = rays_to(points, part);
      if (rays.size() < kFewest || !cross_it(points, rays, mirror.wall, kMirrorFoot)) continue;
      const double before = std::min(mirror.side * off(mirror.wall, walls[w].start),
                                     mirror.side * off(mirror.wall, walls[w].end));
      if (before >= 0 || part.length() > kWhole * walls[w].length()) {
        mirrored[w] = true;
      } else {
        cut_at(mirror, walls[w]);
        shortened.push_back(w);
      }
    }
  }
  for (std::size_t w = 0; w < walls.size(); ++w) walls[w].score -= mirrored[w] ? kMirrored : 0;
  // The caller measures these anew.
  std::erase_if(shortened, [&](std::size_t w) { return mirrored[w]; });
  return shortened;
}

}  // namespace parhelion::semantic
