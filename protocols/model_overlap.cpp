#include "protocols/model_overlap.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace parhelion {
namespace {

using Polygon = std::vector<Eigen::Vector2d>;

bool upright(const ModelEntity& entity) { return entity.T_map_body.rotation()(2, 2) > 1 - 1e-12; }

/// Sutherland-Hodgman: the part of `polygon` where n . x <= d.
Polygon clip(const Polygon& polygon, const Eigen::Vector2d& n, double d) {
  Polygon out;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
    const double side_a = n.dot(a) - d;
    const double side_b = n.dot(b) - d;
    if (side_a <= 0) out.push_back(a);
    if ((side_a < 0 && side_b > 0) || (side_a > 0 && side_b < 0))
      out.push_back(a + (b - a) * (side_a / (side_a - side_b)));
  }
  return out;
}

double area(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return std::abs(twice) / 2;
}

double upright_overlap(const ModelEntity& a, const ModelEntity& b) {
  const Eigen::Vector3d p_a = a.T_map_body.translation();
  const Eigen::Vector3d p_b = b.T_map_body.translation();
  const double top = std::min(p_a.z() + a.size.z() / 2, p_b.z() + b.size.z() / 2);
  const double bottom = std::max(p_a.z() - a.size.z() / 2, p_b.z() - b.size.z() / 2);
  if (top <= bottom) return 0;
  const Transform<Body, Body> T_a_b = a.T_map_body.inverse() * b.T_map_body;
  Polygon polygon;
  for (const auto& [sx, sy] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    polygon.push_back((T_a_b * Eigen::Vector3d(sx * b.size.x() / 2, sy * b.size.y() / 2, 0)).head<2>());
  }
  polygon = clip(polygon, {1, 0}, a.size.x() / 2);
  polygon = clip(polygon, {-1, 0}, a.size.x() / 2);
  polygon = clip(polygon, {0, 1}, a.size.y() / 2);
  polygon = clip(polygon, {0, -1}, a.size.y() / 2);
  return area(polygon) * (top - bottom);
}

/// Fraction of grid points in `inner` that lie in `outer`.
double sampled_fraction(const ModelEntity& inner, const ModelEntity& outer) {
  constexpr int n = 24;
  const Eigen::Isometry3d T = outer.T_map_body.inverse().isometry() * inner.T_map_body.isometry();
  int inside = 0;
  for (int i = 0; i < n * n * n; ++i) {
    const Eigen::Array3d cell(i % n, i / n % n, i / n / n);
    const Eigen::Vector3d p = ((cell + 0.5) / n - 0.5) * inner.size.array();
    inside += ((T * p).array().abs() <= outer.size.array() / 2).all() ? 1 : 0;
  }
  return static_cast<double>(inside) / (n * n * n);
}

/// Half lengths of the axis-aligned box around an entity.
Eigen::Vector3d half_extent(const ModelEntity& entity) {
  return entity.T_map_body.rotation().cwiseAbs() * entity.size / 2;
}

}  // namespace

double overlap_fraction(const ModelEntity& a, const ModelEntity& b) {
  const bool a_smaller = a.size.prod() <= b.size.prod();
  if (!upright(a) || !upright(b)) return a_smaller ? sampled_fraction(a, b) : sampled_fraction(b, a);
  return upright_overlap(a, b) / std::min(a.size.prod(), b.size.prod());
}

std::optional<std::pair<std::size_t, std::size_t>> find_overlap(const std::vector<ModelEntity>& entities) {
  // Sweep along x: only boxes whose extents overlap are compared.
  std::vector<Eigen::Vector3d> low, high;
  for (const ModelEntity& entity : entities) {
    low.push_back(entity.T_map_body.translation() - half_extent(entity));
    high.push_back(entity.T_map_body.translation() + half_extent(entity));
  }
  std::vector<std::size_t> order(entities.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
    return std::pair(low[i].x(), i) < std::pair(low[j].x(), j);
  });
  std::optional<std::pair<std::size_t, std::size_t>> first;
  std::vector<std::size_t> open;
  for (const std::size_t i : order) {
    std::erase_if(open, [&](std::size_t j) { return high[j].x() <= low[i].x(); });
    for (const std::size_t j : open) {
      const auto pair = std::minmax(i, j);
      if (first && *first < std::pair<std::size_t, std::size_t>(pair)) continue;
      const ModelEntity& a = entities[i];
      const ModelEntity& b = entities[j];
      const bool apart =
          (low[i].array() >= high[j].array()).any() || (low[j].array() >= high[i].array()).any();
      if (apart || a.label != b.label || a.is_virtual != b.is_virtual) continue;
      if (!is_solid(a) || !is_solid(b)) continue;
      if (overlap_fraction(a, b) > 0.5) first = pair;
    }
    open.push_back(i);
  }
  return first;
}

}  // namespace parhelion
