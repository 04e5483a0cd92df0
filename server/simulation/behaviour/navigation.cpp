#include "server/simulation/behaviour/navigation.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/simulation/behaviour/wandering.hpp"
#include "server/simulation/world/place_text.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kRouteRoom = 0.03;      // m of clearance of a route in addition to the agent's radius
constexpr double kGoalMoved = 0.7;       // m that a goal moves before its route is searched again
constexpr double kSwitchDistance = 2.0;  // m from a corner at which the next one is tried
constexpr double kRetry = 5.0;           // s until an unsuccessful search is repeated
constexpr int kMaxFailures = 3;          // then the goal is reported unreachable

}  // namespace

double room_of(const Agent& agent) { return agent.form.footprint.bound + kRouteRoom; }

bool walks_through(const Agent& agent, const FixedObstacle& leaf, const Environment& environment) {
  if (!leaf.opens_when_pushed || !agent.definition.behaviour.opens_doors) return false;
  return environment.doors.opens_when_pushed(*environment.building, leaf, agent.pose.position());
}

RouteGrid& Navigation::grid_of(const Agent& agent, const Environment& environment) {
  return router_.grid(environment.building, agent.floor, agent.form.size.z());
}

/// Areas to avoid: closed doors and, if the last route was blocked, standing agents.
RouteQuery Navigation::query_to(const Agent& agent, const Eigen::Vector2d& goal, bool round_agents,
                                const Surroundings& around) {
  const Environment& environment = around.environment;
  RouteQuery query{agent.pose.position(), goal, room_of(agent), {}, {}};
  for (const FixedObstacle* door : router_.doors(environment.building)) {
    if (!walks_through(agent, *door, environment)) query.blocked.push_back(door->footprint);
  }
  for (const Footprint& zone : exclusion_zone) query.blocked.push_back(zone);
  if (!round_agents) return query;
  constexpr double matters = 8.0;  // m: farther ones will have moved
  const auto near_enough = [&](const Footprint& other) {
    return (other.center - query.start).norm() < matters && (other.center - goal).norm() > other.bound;
  };
  for (const Agent& other : around.agents) {
    const bool stands = other.rigid.velocity.head<2>().norm() < 0.1;
    if (&other != &agent && stands && near_enough(other.placed)) query.blocked.push_back(other.placed);
  }
  for (const RealRobot& real : around.real_robots) {
    if (real.ever_present && near_enough(real.placed)) query.blocked.push_back(real.placed);
  }
  for (const Footprint& disc : environment.unmodelled) {
    if (near_enough(disc)) query.blocked.push_back(disc);
  }
  for (const PlacedPerson& person : environment.people.placed()) {
    if (person.velocity.norm() < 0.1 && near_enough(person.disc)) query.blocked.push_back(person.disc);
  }
  return query;
}

bool Navigation::is_straight_free(const Agent& agent, const Eigen::Vector2d& p,
                                  const Environment& environment) {
  const Eigen::Vector2d from = agent.pose.position();
  const double room = room_of(agent);
  const Footprint travel = make_segment(from, p, room);
  const auto meets = [&](const Footprint& other) {
    return distance_bound(travel, other) < 0 && signed_distance(travel, other) < 0;
  };
  const auto& leaves = router_.doors(environment.building);
  if (std::any_of(leaves.begin(), leaves.end(), [&](const FixedObstacle* door) {
        return !walks_through(agent, *door, environment) && meets(door->footprint);
      }))
    return false;
  if (std::any_of(exclusion_zone.begin(), exclusion_zone.end(), meets)) return false;
  RouteGrid& grid = grid_of(agent, environment);
  const double ends = std::min(grid.clearance(from), grid.clearance(p));
  return grid.free_segment(from, p, std::clamp(ends, 0.5 * room, room));
}

void Navigation::request_route(Agent& agent, const Eigen::Vector2d& goal, bool round_agents,
                               const Surroundings& around) {
  agent.route.goal = goal;
  agent.route.requested = true;
  router_.ask(agent.first_body, around.environment.building, agent.floor, agent.form.size.z(),
              query_to(agent, goal, round_agents, around), round_agents);
}

void Navigation::forget_route(Agent& agent) {
  router_.forget(agent.first_body);
  agent.route = {};
  agent.arrived = false;
}

std::string Navigation::why_unreachable(const Router::Answer& answer, const Environment& environment) {
  const bool far = answer.result == RouteSearch::Result::too_large;
  std::string why = far ? "too far to be searched" : "no way leads there";
  if (answer.round_agents) why = "others stand in each way there";
  const auto& leaves = router_.doors(environment.building);
  if (!far && !leaves.empty()) why += "; closed: '" + leaves.front()->name + "'";
  if (!far && leaves.size() > 1) why += " and " + std::to_string(leaves.size() - 1) + " more";
  return why;
}

void Navigation::search_routes(Agents& agents, const Surroundings& around, std::vector<Event>& events) {
  if (router_.idle()) return;
  answers_.clear();
  router_.work(answers_);
  for (Router::Answer& answer : answers_) {
    const auto at = std::find_if(agents.begin(), agents.end(),
                                 [&](const Agent& each) { return each.first_body == answer.who; });
    if (at == agents.end()) continue;
    Agent& agent = *at;
    AgentRoute& route = agent.route;
    route.requested = false;
    if (answer.result == RouteSearch::Result::found) {
      route.points = std::move(answer.points);
      route.next = std::min<std::size_t>(1, route.points.size() - 1);
      continue;
    }
    route.points.clear();
    route.retry_after = around.clock.step + around.clock.steps_in(kRetry);
    route.failures = answer.round_agents ? route.failures + 1 : kMaxFailures;
    // A following agent waits without an event.
    const bool goes = agent.definition.behaviour.kind == BehaviourKind::go;
    if (!goes || route.failures < kMaxFailures || route.reported) continue;
    route.reported = true;
    events.push_back(
        agent_event(EventKind::goal_unreachable, agent, around.clock.now(), 0,
                    place_text(route.goal) + ": " + why_unreachable(answer, around.environment)));
  }
}

/// The farthest point of the route to `goal` that is reachable in a straight line; none without a route.
std::optional<Eigen::Vector2d> Navigation::lookahead_point(Agent& agent, const Eigen::Vector2d& goal,
                                                           const Surroundings& around) {
  const Environment& environment = around.environment;
  AgentRoute& route = agent.route;
  const bool other_goal = (route.goal - goal).norm() > kGoalMoved;
  if (other_goal && !route.requested) route.points.clear();
  if (route.points.empty() && !route.requested) {
    if (other_goal) route.failures = 0;
    if (around.clock.step < route.retry_after && !other_goal) return std::nullopt;
    if (is_straight_free(agent, goal, environment)) {
      route.goal = goal;
      route.points = {agent.pose.position(), goal};
      route.next = 1;
    } else {
      request_route(agent, goal, route.failures > 0, around);
    }
  }
  if (route.points.empty()) return std::nullopt;
  const auto near_corner = [&] { return (route.points[route.next] - agent.pose.position()).norm(); };
  while (route.next + 1 < route.points.size() &&
         (near_corner() < 0.15 || (near_corner() < kSwitchDistance &&
                                   is_straight_free(agent, route.points[route.next + 1], environment))))
    ++route.next;
  return route.points[route.next];
}

/// Drives straight to a point if the line is free, after a turn on the spot if it is not ahead. Steering
/// prefers open space and would avoid a narrow gap.
std::optional<Twist2> Navigation::straight_to(const Agent& agent, const Eigen::Vector2d& point) {
  constexpr double margin = 0.02, enough = 1.0, aligned = 0.5;  // m, m, rad
  const Eigen::Vector2d to = point - agent.pose.position();
  const Pose2 towards{agent.pose.x, agent.pose.y, agent.steering.heading};
  const SteeringLimits limits = limits_of(agent);
  const double distance = to.norm();
  const double travel =
      free_length(towards, limits.radius, margin, 0, std::min(distance + 0.3, 2.0), steering);
  if (travel < std::min(distance, enough)) return std::nullopt;
  const double turn = wrap_angle(agent.steering.heading - agent.pose.yaw);
  const double wz = std::clamp(3 * turn, -limits.yaw_rate, limits.yaw_rate);
  if (std::abs(turn) > aligned) return Twist2{0, 0, wz};
  const double speed = std::min({limits.speed, std::sqrt(limits.acceleration * travel),
                                 0.25 + std::sqrt(limits.acceleration * distance)});
  return Twist2{speed * (1 - 0.8 * std::abs(turn) / aligned), 0, wz};
}

/// Drives to a visible point, and searches a new route when it makes no progress.
Twist2 Navigation::drive_to(Agent& agent, const Eigen::Vector2d& point, const Eigen::Vector2d& goal,
                            const Surroundings& around) {
  const StepClock& clock = around.clock;
  SteeringState& steering_state = agent.steering;
  if (clock.step < steering_state.detour_until) return wander(agent, clock, steering);
  const Eigen::Vector2d to = point - agent.pose.position();
  steering_state.heading = std::atan2(to.y(), to.x());
  for (const Footprint& zone : exclusion_zone) steering.obstacles.push_back(&zone);
  const auto straight = straight_to(agent, point);
  Twist2 twist = straight ? *straight : steer(agent.pose, limits_of(agent), steering, steering_state);
  twist.vx = std::min(twist.vx, std::max(0.1, (goal - agent.pose.position()).norm()));
  const Eigen::Vector2d ahead(std::cos(agent.pose.yaw), std::sin(agent.pose.yaw));
  const bool progress = straight || (twist.vx > 0.05 && ahead.dot(to) > 0);
  steering_state.waited = std::max(0.0, steering_state.waited + (progress ? -2 : 1) * kDecisionPeriod);
  if (steering_state.waited <= kPatience || agent.route.requested) return twist;
  steering_state.waited = 0;
  ++agent.route.failures;
  if (agent.route.failures % 3 == 0) {
    steering_state.heading_until = 0;
    steering_state.detour_until = clock.step + clock.steps_in(2);
  }
  agent.route.points.clear();
  request_route(agent, goal, true, around);
  return twist;
}

Twist2 Navigation::approach(Agent& agent, const Eigen::Vector2d& goal, const Surroundings& around) {
  const auto point = lookahead_point(agent, goal, around);
  return point ? drive_to(agent, *point, goal, around) : Twist2{};
}

}  // namespace parhelion::simulation
