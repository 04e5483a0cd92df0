#include "server/review/nearest_return.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "protocols/nearest_on_segment.hpp"

namespace parhelion::review {
namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();
}

double distance_to_outline(const Eigen::Vector2d& p, const std::vector<Eigen::Vector2d>& outline) {
  double nearest = kInfinity;
  bool inside = true;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d& a = outline[i];
    const Eigen::Vector2d b = outline[(i + 1) % outline.size()], edge = b - a, to = p - a;
    if (edge.x() * to.y() - edge.y() * to.x() < 0) inside = false;
    nearest = std::min(nearest, (nearest_on_segment(p, a, b) - p).norm());
  }
  return inside ? 0 : nearest;
}

NearestReturn::NearestReturn(const RobotDescription& description) : robot_(description) {
  if (!knows()) return;
  const Eigen::Vector2d laser = robot_.laser->T_base_laser.translation().head<2>();
  for (const Eigen::Vector2d& corner : robot_.footprint) reach_ = std::max(reach_, (corner - laser).norm());
}

NearestReturn::Distances NearestReturn::of(const Scan& scan, const ScanInfo* info) {
  Distances nearest{kInfinity, kInfinity};
  if (!knows()) return nearest;
  const LaserDescription& laser = *robot_.laser;
  if (directions_.size() != scan.ranges.size() || angle_min_ != scan.angle_min ||
      angle_increment_ != scan.angle_increment || !scan.angles.empty()) {
    angle_min_ = scan.angle_min;
    angle_increment_ = scan.angle_increment;
    directions_.resize(scan.ranges.size());
    for (std::size_t i = 0; i < directions_.size(); ++i) {
      const double angle = scan.angle(i);
      directions_[i] =
          (laser.T_base_laser.rotation() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0)).head<2>();
    }
  }
  const bool has_beam_agents = info && info->beam_agent.size() == scan.ranges.size();
  const Eigen::Vector2d origin = laser.T_base_laser.translation().head<2>();
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const float range = scan.ranges[i];
    if (laser.convention.classify(range) != BeamKind::hit) continue;
    const bool injected = has_beam_agents && info->beam_agent[i] >= 0;
    // Skip returns that are farther than the nearest one even from the nearest corner.
    const double lower_bound = range * directions_[i].norm() - reach_;
    if (lower_bound >= nearest.any && (!injected || lower_bound >= nearest.injected)) continue;
    const double d = distance_to_outline(origin + range * directions_[i], robot_.footprint);
    nearest.any = std::min(nearest.any, d);
    if (injected) nearest.injected = std::min(nearest.injected, d);
  }
  return nearest;
}

}  // namespace parhelion::review
