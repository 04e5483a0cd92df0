#include "server/simulation/building/planar.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "protocols/nearest_on_segment.hpp"

namespace parhelion::simulation {
namespace {

/// Number of sides; a point has one of zero length.
std::size_t sides(const Footprint& footprint) {
  return footprint.vertices.size() <= 2 ? 1 : footprint.vertices.size();
}

Eigen::Vector2d nearest_on_side(const Eigen::Vector2d& p, const Footprint& footprint, std::size_t side) {
  return nearest_on_segment(p, footprint.vertices[side],
                            footprint.vertices[(side + 1) % footprint.vertices.size()]);
}

/// Smallest squared distance of a's vertices to b's outline.
double squared_vertex_distance(const Footprint& a, const Footprint& b) {
  double best = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector2d& p : a.vertices) {
    for (std::size_t i = 0; i < sides(b); ++i)
      best = std::min(best, (nearest_on_side(p, b, i) - p).squaredNorm());
  }
  return best;
}

/// Largest separation along the outward edge normals of a, and beyond the ends of a segment; a point has
/// none.
double separation_along_normals(const Footprint& a, const Footprint& b) {
  double best = -std::numeric_limits<double>::infinity();
  const std::size_t n = a.vertices.size();
  for (std::size_t i = 0; n > 1 && i < n; ++i) {
    const Eigen::Vector2d edge = a.vertices[(i + 1) % n] - a.vertices[i];
    const double length = edge.norm();
    if (length <= 0) continue;
    const Eigen::Vector2d normal(edge.y() / length, -edge.x() / length);
    double nearest = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector2d& p : b.vertices) nearest = std::min(nearest, normal.dot(p - a.vertices[i]));
    best = std::max(best, nearest);
    if (n != 2) continue;
    double beyond = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector2d& p : b.vertices)
      beyond = std::min(beyond, edge.dot(p - a.vertices[1 - i]) / length);
    best = std::max(best, beyond);
  }
  return best;
}

}  // namespace

Pose2 advance(const Pose2& pose, const Twist2& twist, double t) {
  const double angle = twist.wz * t;
  // sin(a)/a and (1 - cos(a))/a, as series where the quotient loses digits.
  const bool small = std::abs(angle) < 1e-6;
  const double s = small ? 1 - angle * angle / 6 : std::sin(angle) / angle;
  const double c = small ? angle / 2 : (1 - std::cos(angle)) / angle;
  const double forward = (twist.vx * s - twist.vy * c) * t;
  const double left = (twist.vx * c + twist.vy * s) * t;
  const double cos_yaw = std::cos(pose.yaw), sin_yaw = std::sin(pose.yaw);
  return {pose.x + cos_yaw * forward - sin_yaw * left, pose.y + sin_yaw * forward + cos_yaw * left,
          pose.yaw + angle};
}

void Footprint::update_bound() {
  Eigen::Vector2d low = vertices.front(), high = vertices.front();
  for (const Eigen::Vector2d& v : vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  center = (low + high) / 2;
  double farthest = 0;
  for (const Eigen::Vector2d& v : vertices) farthest = std::max(farthest, (v - center).norm());
  bound = farthest + radius;
}

Footprint make_disc(const Eigen::Vector2d& center, double radius) {
  return {{center}, radius, center, radius};
}

Footprint make_segment(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double radius) {
  Footprint footprint{{a, b}, radius, {}, 0};
  footprint.update_bound();
  return footprint;
}

Footprint make_rectangle(double length, double width) {
  const double x = length / 2, y = width / 2;
  return make_polygon({{-x, -y}, {x, -y}, {x, y}, {-x, y}});
}

Footprint make_polygon(std::vector<Eigen::Vector2d> vertices) {
  Footprint footprint{std::move(vertices), 0, {}, 0};
  footprint.update_bound();
  return footprint;
}

void place(const Footprint& local, const Pose2& pose, Footprint& placed) {
  const double c = std::cos(pose.yaw), s = std::sin(pose.yaw);
  const auto moved = [&](const Eigen::Vector2d& v) {
    return Eigen::Vector2d(pose.x + c * v.x() - s * v.y(), pose.y + s * v.x() + c * v.y());
  };
  placed.vertices.resize(local.vertices.size());
  for (std::size_t i = 0; i < local.vertices.size(); ++i) placed.vertices[i] = moved(local.vertices[i]);
  placed.radius = local.radius;
  placed.center = moved(local.center);
  placed.bound = local.bound;
}

double signed_distance(const Footprint& a, const Footprint& b) {
  const double separation = std::max(separation_along_normals(a, b), separation_along_normals(b, a));
  const double radii = a.radius + b.radius;
  // Two points have no normals: their separation is minus infinity and only the distance counts.
  if (std::isfinite(separation) && separation <= 0) return separation - radii;
  const double squared = std::min(squared_vertex_distance(a, b), squared_vertex_distance(b, a));
  return std::sqrt(squared) - radii;
}

double separation(const Footprint& a, const Footprint& b) {
  const double along = std::max(separation_along_normals(a, b), separation_along_normals(b, a));
  return std::isfinite(along) ? along - a.radius - b.radius : signed_distance(a, b);
}

Eigen::Vector2d nearest_point(const Footprint& a, const Footprint& b) {
  double best = std::numeric_limits<double>::infinity();
  Eigen::Vector2d nearest = b.vertices.front();
  const auto consider = [&](const Eigen::Vector2d& on_a, const Eigen::Vector2d& on_b) {
    const double squared = (on_a - on_b).squaredNorm();
    if (squared >= best) return;
    best = squared;
    nearest = on_b;
  };
  for (const Eigen::Vector2d& p : a.vertices) {
    for (std::size_t i = 0; i < sides(b); ++i) consider(p, nearest_on_side(p, b, i));
  }
  for (const Eigen::Vector2d& p : b.vertices) {
    for (std::size_t i = 0; i < sides(a); ++i) consider(nearest_on_side(p, a, i), p);
  }
  return nearest;
}

double fastest_point_speed(const Footprint& local, const Twist2& twist) {
  double fastest = 0;
  for (const Eigen::Vector2d& v : local.vertices) {
    const double x = twist.vx - twist.wz * v.y(), y = twist.vy + twist.wz * v.x();
    fastest = std::max(fastest, x * x + y * y);
  }
  return std::sqrt(fastest) + std::abs(twist.wz) * local.radius;
}

}  // namespace parhelion::simulation
