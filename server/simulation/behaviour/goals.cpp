// Behaviours with a goal position (part of Behaviours): go, follow, flee, block, step aside.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/simulation/behaviour/behaviour.hpp"
#include "server/simulation/world/place_text.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kExclusionTime = 1.5;  // s of distance added to a robot's stopping distance, where nobody
                                        // blocks its path
constexpr double kThreat = 2.0;         // s, look-ahead of a yielding agent
constexpr double kAside = 0.15;         // m of clearance that a yielding agent keeps

Twist2 face(const Agent& agent, const Eigen::Vector2d& p) {
  const Eigen::Vector2d to = p - agent.pose.position();
  const double turn = wrap_angle(std::atan2(to.y(), to.x()) - agent.pose.yaw);
  return {0, 0, std::abs(turn) > 0.1 ? std::clamp(2 * turn, -1.0, 1.0) : 0};
}

}  // namespace

std::optional<Behaviours::Target> Behaviours::target_of(const Behaviour& behaviour,
                                                        const Surroundings& around) {
  const std::string& name = behaviour.target;
  const RealRobots& robots = around.real_robots;
  for (const Agent& agent : around.agents) {
    if (!(name.empty() ? agent.trainee : agent.definition.name == name)) continue;
    const Eigen::Vector3d v = agent.rigid.T_map_body.rotation().transpose() * agent.rigid.velocity;
    const Twist2 twist{v.x(), v.y(), agent.rigid.rotation_rate.z()};
    return Target{agent.pose, twist, &agent.placed, agent.trainee, &robots.front()};
  }
  const auto real = std::find_if(robots.begin(), robots.end(), [&](const RealRobot& robot) {
    return robot.present && (name.empty() || name == robot.name);
  });
  if (real == robots.end()) return std::nullopt;
  return Target{planar_pose(real->last.T_map_base), real->last.twist, &real->placed, true, &*real};
}

void Behaviours::update_exclusion_zone(const Target& target) {
  navigation_.exclusion_zone.clear();
  if (!target.is_trainee) return;
  RealRobotState now;
  now.T_map_base = Transform<Map, Base>::planar(target.pose.x, target.pose.y, target.pose.yaw);
  now.twist = target.twist;
  append_stop_zone(*target.brakes, now, navigation_.exclusion_zone, kExclusionTime);
}

Twist2 Behaviours::go(Agent& agent, const Surroundings& around, std::vector<Event>& events) {
  const auto& waypoints = agent.definition.behaviour.waypoints;
  std::size_t& at = agent.steering.waypoint;
  while (at < waypoints.size() && (waypoints[at] - agent.pose.position()).norm() < kReached) {
    ++at;
    agent.route = {};
    agent.steering.waited = 0;
    events.push_back(
        agent_event(EventKind::goal_reached, agent, around.clock.now(), 0, place_text(waypoints[at - 1])));
    events.back().value = static_cast<double>(at);
  }
  navigation_.exclusion_zone.clear();
  return at < waypoints.size() ? navigation_.approach(agent, waypoints[at], around) : Twist2{};
}

Twist2 Behaviours::follow(Agent& agent, const Surroundings& around) {
  const auto target = target_of(agent.definition.behaviour, around);
  if (!target) return {};
  update_exclusion_zone(*target);
  const double gap = signed_distance(agent.placed, *target->placed);
  const double distance = agent.definition.behaviour.distance;
  // Hysteresis: it starts again only after falling behind by a step.
  agent.arrived = gap < distance + (agent.arrived ? 0.4 : 0.05);
  if (agent.arrived) return {};
  Twist2 twist = navigation_.approach(agent, target->pose.position(), around);
  twist.vx = std::min(twist.vx, std::max(0.0, std::max(std::hypot(target->twist.vx, target->twist.vy),
                                                       std::sqrt(0.5 * std::max(0.0, gap - distance)))));
  return twist;
}

/// Of 16 straight lines the one that leads farthest from the target; none: there is no escape.
std::optional<double> Behaviours::heading_away(const Agent& agent, const Target& target,
                                               const Surroundings& around) {
  constexpr int directions = 16;
  constexpr double look = 2.5;  // m
  RouteGrid& grid = navigation_.grid_of(agent, around.environment);
  const Eigen::Vector2d p = agent.pose.position();
  double best = (p - target.pose.position()).norm() + 0.1;
  std::optional<double> heading;
  for (int i = 0; i < directions; ++i) {
    const double angle = 2 * std::numbers::pi * i / directions;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    const double travel = grid.free_distance(p, direction, look, room_of(agent));
    const Eigen::Vector2d end = p + travel * direction;
    const double along = std::cos(wrap_angle(angle - agent.steering.heading));
    // The path must not come close to the target.
    const Footprint path = make_segment(p, end, 0);
    const double passes = (nearest_point(*target.placed, path) - target.pose.position()).norm();
    const double score = (end - target.pose.position()).norm() + 0.3 * along +
                         std::min(0.0, 2 * (passes - (p - target.pose.position()).norm()));
    if (travel < 0.3 || score <= best) continue;
    best = score;
    heading = angle;
  }
  return heading;
}

Twist2 Behaviours::flee(Agent& agent, const Surroundings& around) {
  const auto target = target_of(agent.definition.behaviour, around);
  if (!target) return {};
  update_exclusion_zone(*target);
  const double gap = signed_distance(agent.placed, *target->placed);
  agent.arrived = gap > agent.definition.behaviour.distance * (agent.arrived ? 1.0 : 1.3);
  if (agent.arrived) return {};
  const auto heading = heading_away(agent, *target, around);
  if (!heading) return {};
  agent.steering.heading = *heading;
  SteeringScratch& steering = navigation_.steering;
  for (const Footprint& zone : navigation_.exclusion_zone) steering.obstacles.push_back(&zone);
  return steer(agent.pose, limits_of(agent), steering, agent.steering);
}

/// A position on the target's predicted path, far enough ahead for the target to stop; sets agent.arrived
/// where the agent is on that path already.
std::optional<Eigen::Vector2d> Behaviours::blocking_place(Agent& agent, const Target& target,
                                                          const Surroundings& around) {
  constexpr double bend = 1.2;                // rad, limit of the target's extrapolated turn
  constexpr double spacing = 0.1, look = 20;  // m
  const double speed = std::hypot(target.twist.vx, target.twist.vy);
  const bool stands = speed < 0.05;
  const double kappa = stands ? 0 : target.twist.wz / speed;
  const Twist2 arc{stands ? 1 : target.twist.vx / speed, stands ? 0 : target.twist.vy / speed, kappa};
  const Eigen::Vector2d p = agent.pose.position();
  const auto point_on_path = [&](double s) { return advance(target.pose, arc, s).position(); };
  const double reach = target.placed->bound + agent.form.footprint.bound + kStopMargin;
  const double stopping = stopping_distance(target.brakes->limits, speed, kExclusionTime);
  const double farthest = std::min(look, std::abs(kappa) > 0 ? bend / std::abs(kappa) : look);
  // The current position suffices if the target must pass there.
  double off_path = look;
  for (double s = reach; s < farthest; s += spacing)
    off_path = std::min(off_path, (point_on_path(s) - p).norm());
  agent.arrived = off_path < (agent.arrived ? 0.25 : 0.1);
  if (agent.arrived) return std::nullopt;
  // The first position that it reaches before the target would have to brake for it.
  RouteGrid& grid = navigation_.grid_of(agent, around.environment);
  const double pace = std::max(0.1, agent.definition.behaviour.speed);
  std::optional<Eigen::Vector2d> place;
  for (double s = reach + stopping + agent.definition.behaviour.distance; s < farthest; s += spacing) {
    const Eigen::Vector2d there = point_on_path(s);
    if (grid.clearance(there) < room_of(agent)) continue;
    place = there;
    const double arrives = (there - p).norm() / pace + 1;
    if (s - reach - stopping >= speed * arrives) break;
  }
  return place;
}

Twist2 Behaviours::block(Agent& agent, const Surroundings& around) {
  const auto target = target_of(agent.definition.behaviour, around);
  if (!target) return {};
  update_exclusion_zone(*target);
  const auto place = blocking_place(agent, *target, around);
  if (agent.arrived) return face(agent, target->pose.position());
  return place ? navigation_.approach(agent, *place, around) : Twist2{};
}

/// The direction that leads out of an approaching vehicle's path soonest.
std::optional<Twist2> Behaviours::step_aside(Agent& agent, const Surroundings& around) {
  const auto threatened = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& velocity, double radius) {
    const Footprint travel = make_segment(from, from + kThreat * velocity, radius);
    return velocity.norm() > 0.05 && signed_distance(travel, agent.placed) < kAside;
  };
  std::optional<std::pair<Eigen::Vector2d, Eigen::Vector2d>> from;  // position, velocity
  const Eigen::Vector2d p = agent.pose.position();
  const auto consider = [&](const Footprint& other, const Eigen::Vector2d& velocity) {
    if (!from && threatened(other.center, velocity, other.bound)) from.emplace(other.center, velocity);
  };
  for (const RealRobot& real : around.real_robots) {
    if (!real.present) continue;
    const Eigen::Vector3d velocity =
        real.last.T_map_base.rotation() * Eigen::Vector3d(real.last.twist.vx, real.last.twist.vy, 0);
    consider(real.placed, velocity.head<2>());
  }
  around.neighbours.near(p, 6, nearby_);
  for (const std::uint32_t i : nearby_) {
    const Agent& other = around.agents[i];
    if (&other == &agent || other.definition.kind != AgentKind::robot) continue;
    if ((other.placed.center - p).norm() < 6) consider(other.placed, other.rigid.velocity.head<2>());
  }
  if (!from) return std::nullopt;
  const Eigen::Vector2d left = Eigen::Vector2d(-from->second.y(), from->second.x()).normalized();
  const double side = left.dot(p - from->first) >= 0 ? 1 : -1;
  RouteGrid& grid = navigation_.grid_of(agent, around.environment);
  const bool room = grid.free_distance(p, side * left, 0.6, room_of(agent)) > 0.3;
  const Eigen::Vector2d aside = (room ? side : -side) * left;
  // People sidestep without turning first.
  const Twist2 away{std::cos(agent.pose.yaw) * aside.x() + std::sin(agent.pose.yaw) * aside.y(),
                    -std::sin(agent.pose.yaw) * aside.x() + std::cos(agent.pose.yaw) * aside.y(), 0};
  const double pace = std::max(0.4, agent.definition.behaviour.speed);
  if (agent.definition.kind == AgentKind::person) return Twist2{pace * away.vx, pace * away.vy, 0};
  agent.steering.heading = std::atan2(aside.y(), aside.x());
  return steer(agent.pose, limits_of(agent), navigation_.steering, agent.steering);
}

}  // namespace parhelion::simulation
