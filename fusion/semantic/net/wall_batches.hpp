// Points and rays by a wall's plane, for many of them at once: loops without branches, since most lie or pass
// elsewhere, and which ones cannot be predicted. Internal to wall_raster.cpp.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "fusion/semantic/net/wall_raster.hpp"

namespace parhelion::semantic {

/// Points of a batch: its coordinates fit the first level of the cache.
inline constexpr std::size_t kWallBatch = 128;

/// Whether a place along a wall and over its foot (m) is inside its raster, or a little beyond its end and
/// top; false of what is no number.
inline int is_inside(const WallRaster& wall, double at, double over) {
  const double length = (wall.columns + 1) * wall.column, height = (wall.rows + 1) * wall.row;
  return static_cast<int>(at >= 0) & static_cast<int>(at <= length) & static_cast<int>(over >= 0) &
         static_cast<int>(over <= height);
}

/// Points around a wall.
class PointBatch {
 public:
  /// For those up to `before` before the wall's plane and up to `behind` behind it, m.
  PointBatch(const WallRaster& wall, double before, double behind)
      : wall_(wall), before_(before), behind_(behind) {}

  /// Calls visit(point, offset, at, over) for these, in their order: m, behind the plane, along the wall,
  /// over its foot.
  template <class Visit>
  void for_each_within(std::span<const PlanPoints::Point> points, Visit&& visit) {
    for (; !points.empty(); points = points.subspan(std::min(kWallBatch, points.size()))) {
      const std::size_t size = std::min(kWallBatch, points.size());
      place(points.first(size));
      const std::size_t count = choose(size);
      for (const std::uint32_t i : std::span(within_).first(count))
        visit(points[i], offset_[i], at_[i], over_[i]);
    }
  }

 private:
  void place(std::span<const PlanPoints::Point> points) {
    const double nx = wall_.away.x(), ny = wall_.away.y(), ax = wall_.along.x(), ay = wall_.along.y(),
                 sx = wall_.start.x(), sy = wall_.start.y(), low = wall_.z_low;
    const PlanPoints::Point* const from = points.data();  // loops with checked accesses are not vectorized
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double x = static_cast<double>(from[i].p.x()) - sx, y = static_cast<double>(from[i].p.y()) - sy;
      offset_[i] = nx * x + ny * y, at_[i] = ax * x + ay * y;
      over_[i] = static_cast<double>(from[i].p.z()) - low;
    }
  }
  std::size_t choose(std::size_t size) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < size; ++i) {
      within_[count] = static_cast<std::uint32_t>(i);
      const int near = static_cast<int>(offset_[i] >= -before_) & static_cast<int>(offset_[i] <= behind_);
      count += static_cast<std::size_t>(near & is_inside(wall_, at_[i], over_[i]));
    }
    return count;
  }

  const WallRaster& wall_;
  double before_, behind_;
  std::array<double, kWallBatch> offset_, at_, over_;  // each written before it is read
  std::array<std::uint32_t, kWallBatch> within_;
};

/// Rays from one viewpoint.
class RayBatch {
 public:
  /// `from`: the viewpoint. What ends within `near` (m) of the wall's plane, or less than `beyond` behind it,
  /// tells nothing.
  RayBatch(const WallRaster& wall, const Eigen::Vector3d& from, double near, double beyond)
      : wall_(wall),
        from_(from),
        near_(near),
        beyond_(beyond),
        a_(wall.away.dot(from.head<2>() - wall.start)) {}

  /// Calls visit(at, over, through), m along the wall and over its foot, for the rays that end at every n-th
  /// of the points, from the first, and pass through the wall, or would if they did not end before it.
  template <class Visit>
  void for_each_hit(std::span<const PlanPoints::Point> points, std::uint32_t n, Visit&& visit) {
    if (std::abs(a_) < near_) return;
    for (std::size_t k = 0; k < points.size(); k += kWallBatch * n) {
      const std::span<const PlanPoints::Point> rest = points.subspan(k);
      const std::size_t size = std::min(kWallBatch, (rest.size() + n - 1) / n);
      for (std::size_t i = 0; i < size; ++i) {
        const Eigen::Vector3d p = rest[i * n].p.cast<double>();
        x_[i] = p.x(), y_[i] = p.y(), z_[i] = p.z();
      }
      meet(size);
      const std::size_t hits = choose(size);
      for (const std::uint32_t i : std::span(hit_).first(hits)) visit(at_[i], over_[i], a_ * b_[i] < 0);
    }
  }

 private:
  void meet(std::size_t size) {
    const double a = a_, nx = wall_.away.x(), ny = wall_.away.y(), ax = wall_.along.x(), ay = wall_.along.y(),
                 sx = wall_.start.x(), sy = wall_.start.y(), fx = from_.x(), fy = from_.y(), fz = from_.z(),
                 low = wall_.z_low;
    for (std::size_t i = 0; i < size; ++i) {
      const double b = nx * (x_[i] - sx) + ny * (y_[i] - sy), part = a / (a - b);
      const double x = fx + (x_[i] - fx) * part, y = fy + (y_[i] - fy) * part, z = fz + (z_[i] - fz) * part;
      b_[i] = b, at_[i] = ax * (x - sx) + ay * (y - sy), over_[i] = z - low;
    }
  }
  std::size_t choose(std::size_t size) {
    const double a = a_, from_plane = std::abs(a_);
    std::size_t hits = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const double b = b_[i], depth = std::abs(b);
      const int through = static_cast<int>(a * b < 0) & static_cast<int>(depth >= beyond_),
                before = static_cast<int>(a * b > 0) & static_cast<int>(depth < from_plane);
      hit_[hits] = static_cast<std::uint32_t>(i);
      hits += static_cast<std::size_t>((through | before) & static_cast<int>(depth >= near_) &
                                       is_inside(wall_, at_[i], over_[i]));
    }
    return hits;
  }

  const WallRaster& wall_;
  Eigen::Vector3d from_;
  double near_, beyond_, a_;                      ///< m; a_: of the viewpoint, behind the wall's plane
  std::array<double, kWallBatch> x_, y_, z_;      // m, ends of the rays; each written before it is read
  std::array<double, kWallBatch> b_, at_, over_;  // m: an end behind the plane; where the ray meets it
  std::array<std::uint32_t, kWallBatch> hit_;
};

}  // namespace parhelion::semantic
