#include "server/simulation/behaviour/behaviour.hpp"

#include <algorithm>
#include <cmath>

#include "server/simulation/behaviour/wandering.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kPredictionTime = 0.7;  // s for which another agent's motion is extrapolated
constexpr double kFreezeRange = 2.0;  // m from a real robot within which agents freeze while its sensors do
                                      // not show them
constexpr double kRespect = 0.15;     // m kept to a real robot, in addition to the margin for everything
constexpr double kScanAge = 0.5;      // s: an older own scan is ignored

/// By the instructor, or near a robot whose sensors do not show the agent.
bool is_frozen(const Agent& agent, const RealRobots& real_robots) {
  if (agent.frozen) return true;
  return std::any_of(real_robots.begin(), real_robots.end(), [&](const RealRobot& real) {
    const bool shown = real.injection_live && agent.seen_by[real.index].shown == AgentShown::shown;
    if (shown || !real.ever_present) return false;
    const double speed = std::hypot(real.last.twist.vx, real.last.twist.vy);
    return distance_bound(agent.placed, real.placed) < kFreezeRange + stopping_distance(real.limits, speed);
  });
}

}  // namespace

void Behaviours::reserve(std::size_t movers, std::size_t obstacles) {
  near_.reserve(4 * obstacles);
  nearby_.reserve(4 * movers + 64);
  SteeringScratch& steering = navigation_.steering;
  steering.obstacles.reserve(obstacles + movers + 512);
  while (steering.predicted.size() < movers) steering.predicted.push_back(make_segment({0, 0}, {0, 0}, 0));
}

void Behaviours::gather_obstacles(const Agent& agent, const Surroundings& around) {
  SteeringScratch& steering = navigation_.steering;
  steering.obstacles.clear();
  std::size_t used = 0;
  // Pointers into the vector are taken only when it is complete.
  const auto predict = [&](const Eigen::Vector2d& center, const Eigen::Vector2d& velocity, double radius) {
    if (used == steering.predicted.size()) steering.predicted.push_back(make_segment(center, center, radius));
    Footprint& swept = steering.predicted[used++];
    swept.vertices[0] = center;
    swept.vertices[1] = center + kPredictionTime * velocity;
    swept.radius = radius;
    swept.update_bound();
  };
  const Eigen::Vector2d p = agent.pose.position();
  const bool sees = agent.laser && agent.laser->measured &&
                    (around.clock.now() - *agent.laser->measured).seconds() < kScanAge;
  if (sees) {
    for (const Footprint& point : agent.laser->points) steering.obstacles.push_back(&point);
  } else {
    near_.clear();
    around.building().near(p, kSight, agent.floor + 0.02, agent.floor + agent.form.size.z(), near_);
    const bool wanders = agent.definition.behaviour.kind == BehaviourKind::wander;
    for (const FixedObstacle* obstacle : near_) {
      if (wanders || !walks_through(agent, *obstacle, around.environment))
        steering.obstacles.push_back(&obstacle->footprint);
    }
  }
  for (const Footprint& disc : around.environment.unmodelled) {
    if ((disc.center - p).norm() < kSight + disc.bound) steering.obstacles.push_back(&disc);
  }
  nearby_.clear();
  if (!sees) around.neighbours.near(p, kSight, nearby_);
  for (const std::uint32_t i : nearby_) {
    const Agent* other = &around.agents[i];
    if (other == &agent || (other->placed.center - p).norm() > kSight + other->placed.bound) continue;
    if (other->form.upright) {
      predict(other->placed.center, other->rigid.velocity.head<2>(), other->placed.bound);
    } else {
      steering.obstacles.push_back(&other->placed);
    }
  }
  for (const PlacedPerson& person : around.environment.people.placed()) {
    if ((person.disc.center - p).norm() < kSight + person.disc.bound)
      predict(person.disc.center, person.velocity, person.disc.bound + kRespect);
  }
  // Agents keep clear of real robots even if their own laser does not show them.
  for (const RealRobot& real : around.real_robots) {
    if (!real.ever_present || (real.placed.center - p).norm() >= kSight + real.placed.bound) continue;
    const Eigen::Vector3d velocity =
        real.last.T_map_base.rotation() * Eigen::Vector3d(real.last.twist.vx, real.last.twist.vy, 0);
    predict(real.placed.center, velocity.head<2>(), real.placed.bound + kRespect);
  }
  for (std::size_t i = 0; i < used; ++i) steering.obstacles.push_back(&steering.predicted[i]);
}

Twist2 Behaviours::decide(Agent& agent, const Surroundings& around, std::vector<Event>& events) {
  if (agent.definition.behaviour.yields) {
    if (const auto aside = step_aside(agent, around)) return *aside;
  }
  switch (agent.definition.behaviour.kind) {
    case BehaviourKind::patrol:
      return patrol(agent, around.clock, navigation_.steering);
    case BehaviourKind::wander:
      return wander(agent, around.clock, navigation_.steering);
    case BehaviourKind::follow:
      return follow(agent, around);
    case BehaviourKind::flee:
      return flee(agent, around);
    case BehaviourKind::block:
      return block(agent, around);
    case BehaviourKind::go:
      return go(agent, around, events);
    case BehaviourKind::stay:
    case BehaviourKind::teleop:
      break;
  }
  return {};
}

Twist2 Behaviours::wanted(Agent& agent, const Surroundings& around, std::vector<Event>& events) {
  const Behaviour& behaviour = agent.definition.behaviour;
  const bool stays = behaviour.kind == BehaviourKind::stay && !behaviour.yields;
  if (around.clock.waiting || is_frozen(agent, around.real_robots) || stays) return {};
  if (behaviour.kind == BehaviourKind::teleop) {
    return agent.teleop_until && around.clock.now() <= *agent.teleop_until ? agent.teleop : Twist2{};
  }
  if (decides(agent, around.clock)) {
    gather_obstacles(agent, around);
    agent.steering.wanted = decide(agent, around, events);
  }
  return agent.steering.wanted;
}

}  // namespace parhelion::simulation
