#include "server/simulation/bodies/agent.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace parhelion::simulation {

SteeringLimits limits_of(const Agent& agent) {
  SteeringLimits limits;
  limits.speed = agent.definition.behaviour.speed;
  limits.radius = agent.form.footprint.bound;
  if (agent.definition.kind == AgentKind::person) {
    limits.yaw_rate = 2.0;
    limits.acceleration = 1.2;
    limits.angular_acceleration = 6.0;
  }
  return limits;
}

bool decides(const Agent& agent, const StepClock& clock) {
  const auto period = static_cast<std::uint64_t>(std::max(1.0, std::round(kDecisionPeriod * clock.rate)));
  return (clock.step + agent.decision_offset) % period == 0;
}

Event agent_event(EventKind kind, const Agent& agent, SimulationTime now, std::uint64_t request,
                  std::string text) {
  Event event;
  event.stamp = now;
  event.kind = kind;
  event.subject = agent.definition.name;
  event.position = {agent.pose.x, agent.pose.y, agent.floor};
  event.request = request;
  event.text = std::move(text);
  return event;
}

}  // namespace parhelion::simulation
