// Agents that want to be somewhere: to go, to follow, to flee, to block, to step aside.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "server/simulation/state.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kReached = 0.3;     // m from a waypoint
constexpr double kRouteRoom = 0.03;  // m that a way keeps beyond the agent's radius
constexpr double kGoalMoved = 0.7;   // m that a goal moves before its way is looked for again
constexpr double kLookAhead = 2.0;   // m from a corner at which the next one is looked for
constexpr double kPatience = 3.0;    // s without progress before another way is looked for
constexpr double kRetry = 5.0;       // s until it asks again where no way led there
constexpr int kMostFailures = 3;     // then it says so
constexpr double kFair = 1.5;        // s beyond its stopping distance that nobody steps in a robot's way
constexpr double kThreat = 2.0;      // s ahead that whoever yields looks
constexpr double kAside = 0.15;      // m more than touching that whoever yields keeps

std::string place_text(const Eigen::Vector2d& p) {
  char text[64];
  std::snprintf(text, sizeof text, "(%.2f, %.2f)", p.x(), p.y());
  return text;
}

double room_of(const Agent& agent) { return agent.form.footprint.bound + kRouteRoom; }

Twist2 face(const Agent& agent, const Eigen::Vector2d& p) {
  const Eigen::Vector2d to = p - agent.pose.position();
  const double turn = wrap_angle(std::atan2(to.y(), to.x()) - agent.pose.yaw);
  return {0, 0, std::abs(turn) > 0.1 ? std::clamp(2 * turn, -1.0, 1.0) : 0};
}

}  // namespace

RouteGrid& Simulation::State::grid_of(const Agent& agent) {
  return router.grid(building, agent.floor, agent.form.size.z());
}

std::optional<Simulation::State::Target> Simulation::State::target_of(const Behaviour& behaviour) {
  const std::string& name = behaviour.target;
  const auto is_it = [&](const auto& agent) {
    return name.empty() ? agent->trainee : agent->definition.name == name;
  };
  const auto at = std::find_if(agents.begin(), agents.end(), is_it);
  if (at != agents.end()) {
    const Agent& agent = **at;
    const Eigen::Vector3d v = agent.rigid.T_map_body.rotation().transpose() * agent.rigid.velocity;
    const Twist2 twist{v.x(), v.y(), agent.rigid.rotation_rate.z()};
    return Target{agent.pose, twist, &agent.placed, agent.trainee};
  }
  if (!real.present || !(name.empty() || name == real.name)) return std::nullopt;
  return Target{planar_pose(real.last.T_map_base), real.last.twist, &real.placed, true};
}

void Simulation::State::gather_fair_zone(const Target& target) {
  fair_zone.clear();
  if (!target.is_trainee) return;
  RealRobotState now;
  now.T_map_base = Transform<Map, Base>::planar(target.pose.x, target.pose.y, target.pose.yaw);
  now.twist = target.twist;
  stop_zone(now, fair_zone, kFair);
}

/// What a way goes round: closed doors and, where the last way was blocked, whoever stands there.
RouteQuery Simulation::State::query_to(const Agent& agent, const Eigen::Vector2d& goal, bool round_agents) {
  RouteQuery query{agent.pose.position(), goal, room_of(agent), {}, {}};
  for (const FixedObstacle* door : router.doors(building)) {
    if (!walks_through(agent, *door)) query.blocked.push_back(door->footprint);
  }
  for (const Footprint& zone : fair_zone) query.blocked.push_back(zone);
  if (!round_agents) return query;
  constexpr double matters = 8.0;  // m: farther ones will have moved
  const auto near_enough = [&](const Footprint& other) {
    return (other.center - query.start).norm() < matters && (other.center - goal).norm() > other.bound;
  };
  for (const auto& other : agents) {
    const bool stands = other->rigid.velocity.head<2>().norm() < 0.1;
    if (other.get() != &agent && stands && near_enough(other->placed)) query.blocked.push_back(other->placed);
  }
  if (real.ever_present && near_enough(real.placed)) query.blocked.push_back(real.placed);
  for (const Footprint& disc : real_discs) {
    if (near_enough(disc)) query.blocked.push_back(disc);
  }
  return query;
}

bool Simulation::State::sees(const Agent& agent, const Eigen::Vector2d& p) {
  const Eigen::Vector2d from = agent.pose.position();
  const double room = room_of(agent);
  const Footprint way = make_segment(from, p, room);
  const auto meets = [&](const Footprint& other) {
    return distance_bound(way, other) < 0 && signed_distance(way, other) < 0;
  };
  const auto& leaves = router.doors(building);
  if (std::any_of(leaves.begin(), leaves.end(), [&](const FixedObstacle* door) {
        return !walks_through(agent, *door) && meets(door->footprint);
      }))
    return false;
  if (std::any_of(fair_zone.begin(), fair_zone.end(), meets)) return false;
  RouteGrid& grid = grid_of(agent);
  const double ends = std::min(grid.clearance(from), grid.clearance(p));
  return grid.free_segment(from, p, std::clamp(ends, 0.5 * room, room));
}

void Simulation::State::ask_route(Agent& agent, const Eigen::Vector2d& goal, bool round_agents) {
  agent.route.goal = goal;
  agent.route.asked = true;
  router.ask(agent.first_body, building, agent.floor, agent.form.size.z(),
             query_to(agent, goal, round_agents), round_agents);
}

void Simulation::State::forget_route(Agent& agent) {
  router.forget(agent.first_body);
  agent.route = {};
  agent.arrived = false;
}

void Simulation::State::take_routes() {
  if (router.idle()) return;
  route_answers.clear();
  router.work(route_answers);
  for (Router::Answer& answer : route_answers) {
    const auto at = std::find_if(agents.begin(), agents.end(),
                                 [&](const auto& each) { return each->first_body == answer.who; });
    if (at == agents.end()) continue;
    Agent& agent = **at;
    AgentRoute& route = agent.route;
    route.asked = false;
    if (answer.result == RouteSearch::Result::found) {
      route.points = std::move(answer.points);
      route.next = std::min<std::size_t>(1, route.points.size() - 1);
      continue;
    }
    route.points.clear();
    route.ask_again = step + static_cast<std::uint64_t>(kRetry * options.rate);
    route.failures = answer.round_agents ? route.failures + 1 : kMostFailures;
    // Whoever follows waits for better times without a word.
    const bool goes = agent.definition.behaviour.kind == BehaviourKind::go;
    if (!goes || route.failures < kMostFailures || route.said) continue;
    route.said = true;
    const bool far = answer.result == RouteSearch::Result::too_large;
    std::string why = far ? "too far to be searched" : "no way leads there";
    if (answer.round_agents) why = "others stand in each way there";
    const auto& leaves = router.doors(building);
    if (!far && !leaves.empty()) why += "; closed: '" + leaves.front()->name + "'";
    if (!far && leaves.size() > 1) why += " and " + std::to_string(leaves.size() - 1) + " more";
    say(EventKind::goal_unreachable, agent, 0, place_text(route.goal) + ": " + why);
  }
}

/// The point of the way to `goal` that it can go to straight; nothing while there is none.
std::optional<Eigen::Vector2d> Simulation::State::lead(Agent& agent, const Eigen::Vector2d& goal) {
  AgentRoute& route = agent.route;
  const bool other_goal = (route.goal - goal).norm() > kGoalMoved;
  if (other_goal && !route.asked) route.points.clear();
  if (route.points.empty() && !route.asked) {
    if (other_goal) route.failures = 0;
    if (step < route.ask_again && !other_goal) return std::nullopt;
    if (sees(agent, goal)) {
      route.goal = goal;
      route.points = {agent.pose.position(), goal};
      route.next = 1;
    } else {
      ask_route(agent, goal, route.failures > 0);
    }
  }
  if (route.points.empty()) return std::nullopt;
  const auto near_corner = [&] { return (route.points[route.next] - agent.pose.position()).norm(); };
  while (route.next + 1 < route.points.size() &&
         (near_corner() < 0.15 || (near_corner() < kLookAhead && sees(agent, route.points[route.next + 1]))))
    ++route.next;
  return route.points[route.next];
}

/// Straight at a point, where nothing is in the way: a turn on the spot first, where it is not ahead.
/// Steering looks for room and would rather go round a narrow gap.
std::optional<Twist2> Simulation::State::straight_to(const Agent& agent, const Eigen::Vector2d& point) {
  constexpr double margin = 0.02, enough = 1.0, aligned = 0.5;  // m, m, rad
  const Eigen::Vector2d to = point - agent.pose.position();
  const Pose2 towards{agent.pose.x, agent.pose.y, agent.steering.heading};
  const SteeringLimits limits = limits_of(agent);
  const double distance = to.norm();
  const double way = free_length(towards, limits.radius, margin, 0, std::min(distance + 0.3, 2.0), steering);
  if (way < std::min(distance, enough)) return std::nullopt;
  const double turn = wrap_angle(agent.steering.heading - agent.pose.yaw);
  const double wz = std::clamp(3 * turn, -limits.yaw_rate, limits.yaw_rate);
  if (std::abs(turn) > aligned) return Twist2{0, 0, wz};
  const double speed = std::min(
      {limits.speed, std::sqrt(limits.acceleration * way), 0.25 + std::sqrt(limits.acceleration * distance)});
  return Twist2{speed * (1 - 0.8 * std::abs(turn) / aligned), 0, wz};
}

/// Drives to a point that it sees, and looks for another way when it comes no further.
Twist2 Simulation::State::drive_to(Agent& agent, const Eigen::Vector2d& point, const Eigen::Vector2d& goal) {
  SteeringState& steering_state = agent.steering;
  if (step < steering_state.detour_until) return wander(agent);
  const Eigen::Vector2d to = point - agent.pose.position();
  steering_state.heading = std::atan2(to.y(), to.x());
  for (const Footprint& zone : fair_zone) steering.obstacles.push_back(&zone);
  const auto straight = straight_to(agent, point);
  Twist2 twist = straight ? *straight : steer(agent.pose, limits_of(agent), steering, steering_state);
  twist.vx = std::min(twist.vx, std::max(0.1, (goal - agent.pose.position()).norm()));
  const Eigen::Vector2d ahead(std::cos(agent.pose.yaw), std::sin(agent.pose.yaw));
  const bool progress = straight || (twist.vx > 0.05 && ahead.dot(to) > 0);
  steering_state.waited = std::max(0.0, steering_state.waited + (progress ? -2 : 1) * kDecisionPeriod);
  if (steering_state.waited <= kPatience || agent.route.asked) return twist;
  steering_state.waited = 0;
  ++agent.route.failures;
  if (agent.route.failures % 3 == 0) {
    steering_state.heading_until = 0;
    steering_state.detour_until = step + static_cast<std::uint64_t>(2 * options.rate);
  }
  agent.route.points.clear();
  ask_route(agent, goal, true);
  return twist;
}

Twist2 Simulation::State::approach(Agent& agent, const Eigen::Vector2d& goal) {
  const auto point = lead(agent, goal);
  return point ? drive_to(agent, *point, goal) : Twist2{};
}

Twist2 Simulation::State::go(Agent& agent) {
  const auto& waypoints = agent.definition.behaviour.waypoints;
  std::size_t& at = agent.steering.waypoint;
  while (at < waypoints.size() && (waypoints[at] - agent.pose.position()).norm() < kReached) {
    ++at;
    agent.route = {};
    agent.steering.waited = 0;
    say(EventKind::goal_reached, agent, 0, place_text(waypoints[at - 1]));
    events.back().value = static_cast<double>(at);
  }
  fair_zone.clear();
  return at < waypoints.size() ? approach(agent, waypoints[at]) : Twist2{};
}

Twist2 Simulation::State::follow(Agent& agent) {
  const auto target = target_of(agent.definition.behaviour);
  if (!target) return {};
  gather_fair_zone(*target);
  const double gap = signed_distance(agent.placed, *target->placed);
  const double distance = agent.definition.behaviour.distance;
  // It sets out again when it has fallen behind by a step, not by a millimetre.
  agent.arrived = gap < distance + (agent.arrived ? 0.4 : 0.05);
  if (agent.arrived) return {};
  Twist2 twist = approach(agent, target->pose.position());
  twist.vx = std::min(twist.vx, std::max(0.0, std::max(std::hypot(target->twist.vx, target->twist.vy),
                                                       std::sqrt(0.5 * std::max(0.0, gap - distance)))));
  return twist;
}

/// Away from the target along that of 16 straight ways that leads farthest from it.
Twist2 Simulation::State::flee(Agent& agent) {
  constexpr int directions = 16;
  constexpr double look = 2.5;  // m
  const auto target = target_of(agent.definition.behaviour);
  if (!target) return {};
  gather_fair_zone(*target);
  const double gap = signed_distance(agent.placed, *target->placed);
  agent.arrived = gap > agent.definition.behaviour.distance * (agent.arrived ? 1.0 : 1.3);
  if (agent.arrived) return {};
  RouteGrid& grid = grid_of(agent);
  const Eigen::Vector2d p = agent.pose.position();
  double best = (p - target->pose.position()).norm() + 0.1;
  std::optional<double> heading;
  for (int i = 0; i < directions; ++i) {
    const double angle = 2 * std::numbers::pi * i / directions;
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    const double way = grid.free_way(p, direction, look, room_of(agent));
    const Eigen::Vector2d end = p + way * direction;
    const double along = std::cos(wrap_angle(angle - agent.steering.heading));
    // On the way it must not come past whom it flees.
    const Footprint path = make_segment(p, end, 0);
    const double passes = (nearest_point(*target->placed, path) - target->pose.position()).norm();
    const double score = (end - target->pose.position()).norm() + 0.3 * along +
                         std::min(0.0, 2 * (passes - (p - target->pose.position()).norm()));
    if (way < 0.3 || score <= best) continue;
    best = score;
    heading = angle;
  }
  if (!heading) return {};
  agent.steering.heading = *heading;
  for (const Footprint& zone : fair_zone) steering.obstacles.push_back(&zone);
  return steer(agent.pose, limits_of(agent), steering, agent.steering);
}

/// Stands on the way that the target is expected to take, so far ahead that it can stop, and stays there.
Twist2 Simulation::State::block(Agent& agent) {
  constexpr double bend = 1.2;                // rad of its turn that are believed
  constexpr double spacing = 0.1, look = 20;  // m
  const auto target = target_of(agent.definition.behaviour);
  if (!target) return {};
  gather_fair_zone(*target);
  const double speed = std::hypot(target->twist.vx, target->twist.vy);
  const bool stands = speed < 0.05;
  const double kappa = stands ? 0 : target->twist.wz / speed;
  const Twist2 arc{stands ? 1 : target->twist.vx / speed, stands ? 0 : target->twist.vy / speed, kappa};
  const Eigen::Vector2d p = agent.pose.position();
  const auto on_way = [&](double s) { return advance(target->pose, arc, s).position(); };
  const double reach = target->placed->bound + agent.form.footprint.bound + kStopMargin;
  const double stopping =
      speed * (real.limits.reaction_time + kFair) + speed * speed / (2 * real.limits.deceleration);
  const double farthest = std::min(look, std::abs(kappa) > 0 ? bend / std::abs(kappa) : look);
  // Where it stands already is good enough while the target must pass there.
  double off_way = look;
  for (double s = reach; s < farthest; s += spacing) off_way = std::min(off_way, (on_way(s) - p).norm());
  agent.arrived = off_way < (agent.arrived ? 0.25 : 0.1);
  if (agent.arrived) return face(agent, target->pose.position());
  // The first place where it is before the target would have to brake for it.
  RouteGrid& grid = grid_of(agent);
  const double pace = std::max(0.1, agent.definition.behaviour.speed);
  std::optional<Eigen::Vector2d> place;
  for (double s = reach + stopping + agent.definition.behaviour.distance; s < farthest; s += spacing) {
    const Eigen::Vector2d there = on_way(s);
    if (grid.clearance(there) < room_of(agent)) continue;
    place = there;
    const double arrives = (there - p).norm() / pace + 1;
    if (s - reach - stopping >= speed * arrives) break;
  }
  return place ? approach(agent, *place) : Twist2{};
}

/// Somebody who drives comes at it: the direction that leads out of the way soonest.
std::optional<Twist2> Simulation::State::step_aside(Agent& agent) {
  const auto threatened = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& velocity, double radius) {
    const Footprint way = make_segment(from, from + kThreat * velocity, radius);
    return velocity.norm() > 0.05 && signed_distance(way, agent.placed) < kAside;
  };
  std::optional<std::pair<Eigen::Vector2d, Eigen::Vector2d>> from;  // place, velocity
  const Eigen::Vector2d p = agent.pose.position();
  const auto consider = [&](const Footprint& other, const Eigen::Vector2d& velocity) {
    if (!from && threatened(other.center, velocity, other.bound)) from.emplace(other.center, velocity);
  };
  if (real.present) {
    const Eigen::Vector3d velocity =
        real.last.T_map_base.rotation() * Eigen::Vector3d(real.last.twist.vx, real.last.twist.vy, 0);
    consider(real.placed, velocity.head<2>());
  }
  neighbours.near(p, 6, nearby);
  for (const std::uint32_t i : nearby) {
    const Agent* other = agents[i].get();
    if (other == &agent || other->definition.kind != AgentKind::robot) continue;
    if ((other->placed.center - p).norm() < 6) consider(other->placed, other->rigid.velocity.head<2>());
  }
  if (!from) return std::nullopt;
  const Eigen::Vector2d left = Eigen::Vector2d(-from->second.y(), from->second.x()).normalized();
  const double side = left.dot(p - from->first) >= 0 ? 1 : -1;
  RouteGrid& grid = grid_of(agent);
  const bool room = grid.free_way(p, side * left, 0.6, room_of(agent)) > 0.3;
  const Eigen::Vector2d aside = (room ? side : -side) * left;
  // A step to the side, not a turn first: people do.
  const Twist2 away{std::cos(agent.pose.yaw) * aside.x() + std::sin(agent.pose.yaw) * aside.y(),
                    -std::sin(agent.pose.yaw) * aside.x() + std::cos(agent.pose.yaw) * aside.y(), 0};
  const double pace = std::max(0.4, agent.definition.behaviour.speed);
  if (agent.definition.kind == AgentKind::person) return Twist2{pace * away.vx, pace * away.vy, 0};
  agent.steering.heading = std::atan2(aside.y(), aside.x());
  return steer(agent.pose, limits_of(agent), steering, agent.steering);
}

}  // namespace parhelion::simulation
