#include "server/simulation/behaviour/wandering.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocols/splitmix64.hpp"

namespace parhelion::simulation {
namespace {

/// A function of (stream, step, draw), so that a skipped decision does not shift later draws.
double random_unit(std::uint64_t stream, std::uint64_t step, std::uint64_t draw) {
  return unit_interval(splitmix64(stream + step * 0xD1B54A32D192ED03ULL + draw * 0x8CB92BA72F3D8DD7ULL));
}

}  // namespace

std::uint64_t random_stream(std::uint64_t seed, std::uint64_t name_hash) {
  return seed * kSplitMix64Increment + name_hash;
}

Twist2 wander(Agent& agent, const StepClock& clock, SteeringScratch& steering) {
  SteeringState& steer_state = agent.steering;
  if (clock.step >= steer_state.heading_until) {
    const double turn = random_unit(agent.random_stream, clock.step, 0) - 0.5;
    const double pause = 4 + 6 * random_unit(agent.random_stream, clock.step, 1);
    steer_state.heading = wrap_angle(agent.pose.yaw + turn * 1.5 * std::numbers::pi);
    steer_state.heading_until = clock.step + clock.steps_in(pause);
  }
  return steer(agent.pose, limits_of(agent), steering, steer_state);
}

Twist2 patrol(Agent& agent, const StepClock& clock, SteeringScratch& steering) {
  SteeringState& steer_state = agent.steering;
  const auto& waypoints = agent.definition.behaviour.waypoints;
  steer_state.waypoint %= waypoints.size();
  Eigen::Vector2d to = waypoints[steer_state.waypoint] - agent.pose.position();
  if (to.norm() < kReached) {
    steer_state.waypoint = (steer_state.waypoint + 1) % waypoints.size();
    steer_state.waited = 0;
    to = waypoints[steer_state.waypoint] - agent.pose.position();
    if (to.norm() < kReached) return {};  // a single waypoint was reached
  }
  if (clock.step < steer_state.detour_until) return wander(agent, clock, steering);
  steer_state.heading = std::atan2(to.y(), to.x());
  Twist2 twist = steer(agent.pose, limits_of(agent), steering, steer_state);
  const double distance = to.norm();
  const Eigen::Vector2d ahead(std::cos(agent.pose.yaw), std::sin(agent.pose.yaw));
  // Slower near a waypoint, to avoid circling it.
  twist.vx = std::min(twist.vx, std::max(0.1, distance));
  const bool progress = twist.vx > 0.05 && ahead.dot(to) > 0;
  steer_state.waited = progress ? std::max(0.0, steer_state.waited - 2 * kDecisionPeriod)
                                : steer_state.waited + kDecisionPeriod;
  if (steer_state.waited > kPatience) {
    steer_state.waited = 0;
    steer_state.heading_until = 0;
    steer_state.detour_until =
        clock.step + clock.steps_in(2 + 2 * random_unit(agent.random_stream, clock.step, 2));
  }
  return twist;
}

}  // namespace parhelion::simulation
