// Intersection of a line with a solid convex shape in the shape's own frame: an interval of distances along
// it.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "protocols/scene.hpp"

namespace parhelion::scan {

/// Inside from `enter` to `leave`; empty where enter > leave.
struct Chord {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();

  static Chord none() {
    return {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  }
  bool empty() const { return enter > leave; }
  /// Distance from the line's origin to the solid; 0 inside; +inf where it lies behind or is missed.
  double range() const {
    if (empty() || leave < 0) return std::numeric_limits<double>::infinity();
    return enter > 0 ? enter : 0;
  }
};

/// Between the planes at -half and +half of one axis (Kay and Kajiya's slabs, SIGGRAPH 1986).
inline Chord slab(double origin, double direction, double half) {
  if (direction == 0) return std::abs(origin) <= half ? Chord{} : Chord::none();
  const double inverse = 1 / direction;
  const double a = (-half - origin) * inverse, b = (half - origin) * inverse;
  return a < b ? Chord{a, b} : Chord{b, a};
}

inline Chord both(const Chord& a, const Chord& b) {
  return {std::max(a.enter, b.enter), std::min(a.leave, b.leave)};
}

/// Union of two chords of one convex body; an empty one adds nothing.
inline Chord either(const Chord& a, const Chord& b) {
  return {std::min(a.enter, b.enter), std::max(a.leave, b.leave)};
}

inline Chord box_chord(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                       const Eigen::Vector3d& half) {
  return both(both(slab(origin.x(), direction.x(), half.x()), slab(origin.y(), direction.y(), half.y())),
              slab(origin.z(), direction.z(), half.z()));
}

/// A sphere (3 dimensions) or an infinite cylinder about the omitted axis (2 dimensions).
template <class Vector>
Chord round_chord(const Vector& origin, const Vector& direction, double radius) {
  const double a = direction.squaredNorm();
  if (a == 0) return origin.squaredNorm() <= radius * radius ? Chord{} : Chord::none();
  // Computed from the point nearest to the centre to avoid cancellation at long range (Haines et al., Ray
  // Tracing Gems, chapter 7).
  const double middle = -origin.dot(direction) / a;
  const double miss = (origin + middle * direction).squaredNorm();
  const double half_squared = (radius * radius - miss) / a;
  if (half_squared < 0) return Chord::none();
  const double half = std::sqrt(half_squared);
  return {middle - half, middle + half};
}

inline Chord cylinder_chord(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double radius,
                            double height) {
  return both(round_chord<Eigen::Vector2d>(origin.head<2>(), direction.head<2>(), radius),
              slab(origin.z(), direction.z(), height / 2));
}

inline Chord capsule_chord(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double radius,
                           double height) {
  const Eigen::Vector3d end(0, 0, height / 2);
  Chord chord = cylinder_chord(origin, direction, radius, height);
  if (chord.empty()) chord = Chord::none();
  chord = either(chord, round_chord<Eigen::Vector3d>(origin - end, direction, radius));
  return either(chord, round_chord<Eigen::Vector3d>(origin + end, direction, radius));
}

/// `size` as in Shape; of a mesh its bounding box.
inline Chord shape_chord(ShapeKind kind, const Eigen::Vector3d& size, const Eigen::Vector3d& origin,
                         const Eigen::Vector3d& direction) {
  switch (kind) {
    case ShapeKind::box:
    case ShapeKind::mesh:
      return box_chord(origin, direction, size / 2);
    case ShapeKind::cylinder:
      return cylinder_chord(origin, direction, size.x(), size.z());
    case ShapeKind::sphere:
      return round_chord<Eigen::Vector3d>(origin, direction, size.x());
    case ShapeKind::capsule:
      return capsule_chord(origin, direction, size.x(), size.z());
  }
  return Chord::none();
}

/// Distance along a line to a triangle, hit from either side; +inf where it is missed or lies behind (Moeller
/// and Trumbore 1997). Edges are included with a small tolerance, so that no ray passes between two
/// triangles.
inline double triangle_range(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                             const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  constexpr double none = std::numeric_limits<double>::infinity();
  constexpr double hair = 1e-9;
  const Eigen::Vector3d ab = b - a, ac = c - a, p = direction.cross(ac);
  const double determinant = ab.dot(p);
  if (determinant == 0) return none;
  const Eigen::Vector3d from_a = origin - a, q = from_a.cross(ab);
  const double u = from_a.dot(p) / determinant, v = direction.dot(q) / determinant;
  if (!(u >= -hair && v >= -hair && u + v <= 1 + hair)) return none;
  const double t = ac.dot(q) / determinant;
  return t >= 0 ? t : none;
}

}  // namespace parhelion::scan
