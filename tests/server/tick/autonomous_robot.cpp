#include "tests/server/tick/autonomous_robot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

namespace parhelion::test {
namespace {

constexpr double kSight = 4.0;    // m
constexpr double kMapped = 0.15;  // m from a wall of the map: a return belongs to that wall
constexpr double kGoes = 0.25;    // m/s: slower objects count as standing
constexpr double kStood = 0.8;    // s that an object stands before it is driven around
constexpr double kRoom = 0.14;    // m of clearance from standing objects, in addition to the robot's disc...
constexpr double kClosed = 0.04;  // ...and with less than this the path is blocked
constexpr double kFromMoving = 0.3;  // m between the outlines
constexpr double kFromStanding = 0.10, kMinGap = 0.08;
constexpr double kYawRate = 0.9;  // rad/s
constexpr double kCell = 0.08;    // m
constexpr double kHorizon = 2.5;  // s

/// Distance of p from the polyline `path`, and the point `ahead` m further on from the nearest point.
std::pair<double, Eigen::Vector2d> ahead_on(const std::vector<Eigen::Vector2d>& path,
                                            const Eigen::Vector2d& p, double ahead) {
  double nearest = std::numeric_limits<double>::infinity(), part = 0;
  std::size_t at = 0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Eigen::Vector2d along = path[i + 1] - path[i];
    const double length = std::max(1e-9, along.squaredNorm());
    const double s = std::clamp((p - path[i]).dot(along) / length, 0.0, 1.0);
    const double distance = (path[i] + s * along - p).norm();
    if (distance >= nearest) continue;
    nearest = distance;
    at = i;
    part = s;
  }
  Eigen::Vector2d point = path[at] + part * (path[at + 1] - path[at]);
  for (std::size_t i = at + 1; i < path.size() && ahead > 0; ++i) {
    const Eigen::Vector2d to = path[i] - point;
    const double step = std::min(ahead, to.norm());
    if (step > 0) point += step * to.normalized();
    ahead -= step;
  }
  return {nearest, point};
}

}  // namespace

AutonomousRobot::AutonomousRobot(const RobotDescription& robot,
                                 const std::shared_ptr<const simulation::Building>& building,
                                 const Eigen::Vector2d& goal, double speed)
    : laser_(*robot.laser), grid_(building, 0, robot.height), goal_(goal), speed_(speed) {
  for (const Eigen::Vector2d& corner : robot.footprint) outline_.extend(corner);
}

AutonomousRobot::Points AutonomousRobot::unmapped(const Pose2& pose, const Scan& scan) {
  const auto T_map_laser = Transform<Map, Base>::planar(pose.x, pose.y, pose.yaw) * laser_.T_base_laser;
  Points seen;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double range = scan.ranges[i];
    if (laser_.convention.classify(scan.ranges[i]) != BeamKind::hit || range > kSight) continue;
    const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    const Eigen::Vector2d p =
        (T_map_laser * Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0)).head<2>();
    if (grid_.clearance(p) > kMapped) seen.push_back(p);
  }
  return seen;
}

/// Whether a seen object moves: both of its edges move, while a single moving edge of a standing object may
/// be due to occlusion.
void AutonomousRobot::watch(const Points& seen) {
  obstacle_velocity_.setZero();
  obstacle_moves_ = false;
  if (seen.empty()) {
    edges_.clear();
    return;
  }
  if (edges_.empty()) stood_since_ = t_;
  edges_.push_back({t_, seen.front(), seen.back()});
  while (t_ - edges_.front().t > 0.55) edges_.pop_front();
  const double time = t_ - edges_.front().t;
  if (time < 0.25) return;
  const Eigen::Vector2d first = (seen.front() - edges_.front().first) / time;
  const Eigen::Vector2d last = (seen.back() - edges_.front().last) / time;
  const Eigen::Vector2d slower = first.norm() < last.norm() ? first : last;
  if (slower.norm() < kGoes || first.dot(last) <= 0) return;
  obstacle_velocity_ = slower;
  obstacle_moves_ = true;
  stood_since_ = t_;
}

/// Standing objects are remembered out of sight, until a beam passes through their position.
void AutonomousRobot::remember(const Pose2& pose, const Scan& scan, const Points& seen) {
  if (obstacle_moves_) {
    remembered_.clear();
    return;
  }
  const auto T_laser_map =
      (Transform<Map, Base>::planar(pose.x, pose.y, pose.yaw) * laser_.T_base_laser).isometry().inverse();
  std::erase_if(remembered_, [&](const auto& each) {
    const Eigen::Vector3d p = T_laser_map * Eigen::Vector3d(each.second.x(), each.second.y(), 0);
    const long beam = std::lround((std::atan2(p.y(), p.x()) - scan.angle_min) / scan.angle_increment);
    if (beam < 0 || beam >= static_cast<long>(scan.ranges.size())) return false;
    return static_cast<double>(scan.ranges[static_cast<std::size_t>(beam)]) > p.head<2>().norm() + 0.15;
  });
  for (const Eigen::Vector2d& p : seen)
    remembered_[{std::lround(p.x() / kCell), std::lround(p.y() / kCell)}] = p;
}

void AutonomousRobot::plan(const Pose2& pose) {
  planned_ = t_;
  const double radius = outline_.max().cwiseAbs().cwiseMax(outline_.min().cwiseAbs()).norm();
  simulation::RouteQuery query{pose.position(), goal_, radius + kRoom, {}, {}};
  for (const auto& [cell, p] : remembered_) query.blocked.push_back(simulation::make_disc(p, 0));
  simulation::RouteSearch search(grid_, query, ++searches_);
  std::size_t work = 1'000'000;
  if (search.work(work) == simulation::RouteSearch::Result::found) path_ = search.smooth();
}

bool AutonomousRobot::path_is_blocked(const Pose2& pose) const {
  const double radius = outline_.max().cwiseAbs().cwiseMax(outline_.min().cwiseAbs()).norm();
  for (double s = 0.2; s < 3; s += 0.1) {
    const Eigen::Vector2d point = ahead_on(path_, pose.position(), s).second;
    for (const auto& [cell, p] : remembered_) {
      if ((p - point).norm() < radius + kClosed) return true;
    }
  }
  return false;
}

/// Pure pursuit (Coulter 1992), with a turn on the spot where the path leads elsewhere.
Twist2 AutonomousRobot::follow_path(const Pose2& pose, double speed) const {
  if (speed <= 0 || path_.size() < 2) return {};
  const Eigen::Vector2d to = ahead_on(path_, pose.position(), 0.45).second - pose.position();
  const double off = wrap_angle(std::atan2(to.y(), to.x()) - pose.yaw);
  if (std::abs(off) > 0.6) return {0, 0, std::copysign(kYawRate, off)};
  const double kappa = 2 * std::sin(off) / std::max(0.1, to.norm());
  double v = std::min(speed, std::max(0.15, (goal_ - pose.position()).norm()));
  if (kappa != 0) v = std::min(v, kYawRate / std::abs(kappa));
  return {v, 0, kappa * v};
}

/// m from the outline at `pose` to the nearest of `things`, each displaced by `displacement`.
double AutonomousRobot::gap(const Pose2& pose, const Points& things,
                            const Eigen::Vector2d& displacement) const {
  double nearest = kSight;
  const Eigen::Rotation2Dd R_base_map(-pose.yaw);
  for (const Eigen::Vector2d& p : things)
    nearest = std::min(nearest, outline_.exteriorDistance(
                                    Eigen::Vector2d(R_base_map * (p + displacement - pose.position()))));
  return nearest;
}

/// The smallest gap of the next seconds if it continues along its path with `speed`, or brakes, from
/// `twist` on.
double AutonomousRobot::min_gap(Pose2 pose, Twist2 twist, double speed, const Points& things) const {
  constexpr double dt = 0.1;
  double smallest = kSight;
  for (double t = dt; t < kHorizon; t += dt) {
    const Twist2 wanted = follow_path(pose, speed);
    twist.vx += std::clamp(wanted.vx - twist.vx, -kAcceleration * dt, kAcceleration * dt);
    twist.wz = wanted.wz;
    pose = simulation::advance(pose, twist, dt);
    smallest = std::min(smallest, gap(pose, things, t * obstacle_velocity_));
  }
  return smallest;
}

Twist2 AutonomousRobot::drive(const Pose2& pose, const Twist2& current_twist, const Scan& scan) {
  t_ += kPeriod;
  const Points seen = unmapped(pose, scan);
  watch(seen);
  remember(pose, scan, seen);
  const bool standing = !obstacle_moves_ && t_ - stood_since_ > kStood;
  if (path_.empty() || (standing && t_ - planned_ > 1 && path_is_blocked(pose))) plan(pose);
  Points things = seen;
  for (const auto& [cell, p] : remembered_) things.push_back(p);
  const double here = gap(pose, things, {0, 0});
  const double needed =
      standing || seen.empty() ? std::clamp(0.8 * here, kMinGap, kFromStanding) : kFromMoving;
  // It brakes if no speed keeps enough distance.
  for (const double speed : {speed_, speed_ / 2, 0.15}) {
    if (min_gap(pose, current_twist, speed, things) >= needed) return follow_path(pose, speed);
  }
  return {};
}

}  // namespace parhelion::test
