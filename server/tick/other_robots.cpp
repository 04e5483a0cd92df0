#include "server/tick/other_robots.hpp"

#include <cmath>

namespace parhelion::tick {
namespace {

/// m from a point to a convex outline, counter-clockwise; negative inside. Outside, a lower bound.
double distance_outside(const std::vector<Eigen::Vector2d>& outline, const Eigen::Vector2d& p) {
  double distance = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d along = outline[(i + 1) % outline.size()] - outline[i];
    const Eigen::Vector2d outwards(along.y(), -along.x());
    distance = std::max(distance, outwards.normalized().dot(p - outline[i]));
  }
  return distance;
}

double sigma_of(const RealRobots& real, std::size_t robot) { return real[robot] ? real[robot]->sigma : 0; }

void explain_by(const RobotDescription& robot, double widened, const scan::BodyMotion& body,
                ScanState& scan) {
  double reach = widened;
  for (const Eigen::Vector2d& corner : robot.footprint) reach = std::max(reach, corner.norm() + widened);
  for (std::size_t i = 0; i < scan.rays.size(); ++i) {
    const double range = scan.real.ranges[i];
    if (!std::isfinite(range)) continue;
    const auto T_map_body = interpolate(body.T_map_body_start, body.T_map_body_end, scan.rays.time(i));
    const Eigen::Vector3d p = scan.rays.origin(i) + range * scan.rays.direction(i);
    if ((p - T_map_body.translation()).head<2>().squaredNorm() > reach * reach) continue;
    const Eigen::Vector3d p_body = T_map_body.inverse() * p;
    if (distance_outside(robot.footprint, p_body.head<2>()) <= widened)
      scan.building_hits[i].range = static_cast<float>(range);
  }
}

}  // namespace

void explain_by_other_robots(const TickContext& context, const scan::LaserMotion& laser,
                             const ScanPath& path) {
  ScanState& scan = path.scan;
  bool rays_are_set = false;
  const std::string* explained = nullptr;  // a robot's first body is its base, whose footprint counts
  for (const scan::BodyMotion& body : scan.doors) {
    if (explained != nullptr && *explained == body.body->entity) continue;
    explained = &body.body->entity;
    const auto robot = context.configuration.find_robot(body.body->entity);
    if (!robot || body.body->owner != BodyOwner::real_robot) continue;
    if (!rays_are_set) scan.rays.set(laser, scan::beam_set(scan.real, scan.beam_time));
    rays_are_set = true;
    const double sigma = std::hypot(sigma_of(path.real, context.robot_index), sigma_of(path.real, *robot));
    if (!std::isfinite(sigma)) continue;
    explain_by(context.configuration.robot_at(*robot), kWiden + kSigmas * sigma, body, scan);
  }
}

}  // namespace parhelion::tick
