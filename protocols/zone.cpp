#include "protocols/zone.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "protocols/nearest_on_segment.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

bool sides_cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                 const Eigen::Vector2d& d) {
  const double a_side = cross(d - c, a - c), b_side = cross(d - c, b - c);
  const double c_side = cross(b - a, c - a), d_side = cross(b - a, d - a);
  return a_side * b_side < 0 && c_side * d_side < 0;
}

double distance_to_side(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (nearest_on_segment(p, a, b) - p).norm();
}

}  // namespace

Status check_zone(const Zone& zone) {
  const auto& outline = zone.outline;
  const std::size_t n = outline.size();
  const std::string who = "zone '" + yaml::printable(zone.name) + "': ";
  if (zone.name.empty()) return Error{"a zone has no name: its events need one"};
  if (n < 3) return Error{who + "expected an outline of at least three corners"};
  double area = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (!outline[i].allFinite()) return Error{who + "a corner is not finite"};
    area += cross(outline[i], outline[(i + 1) % n]) / 2;
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = i + 2; k < n; ++k) {
      if (!sides_cross(outline[i], outline[(i + 1) % n], outline[k], outline[(k + 1) % n])) continue;
      return Error{who + "sides " + std::to_string(i + 1) + " and " + std::to_string(k + 1) +
                   " of its outline cross"};
    }
  }
  if (!(std::abs(area) > 1e-6)) return Error{who + "its outline has no area"};
  if (!(zone.bottom < zone.top)) return Error{who + "expected bottom < top"};
  return {};
}

bool inside(const Zone& zone, const Eigen::Vector3d& p, double margin) {
  if (p.z() < zone.bottom - margin || p.z() > zone.top + margin) return false;
  const auto& outline = zone.outline;
  const Eigen::Vector2d q = p.head<2>();
  bool within = false;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0, k = outline.size() - 1; i < outline.size(); k = i++) {
    const Eigen::Vector2d &a = outline[i], &b = outline[k];
    if ((a.y() > q.y()) != (b.y() > q.y()) &&
        q.x() < (b.x() - a.x()) * (q.y() - a.y()) / (b.y() - a.y()) + a.x())
      within = !within;
    if (margin > 0) nearest = std::min(nearest, distance_to_side(q, a, b));
  }
  return within || nearest <= margin;
}

}  // namespace parhelion
