#include "server/simulation/events/robot_supply_watch.hpp"

#include <algorithm>
#include <cmath>

#include "server/simulation/building/hazard_fields.hpp"

namespace parhelion::simulation {

void watch_radio(Agent& agent, const ObservedMotion& motion, const Surroundings& around,
                 std::vector<Event>& events) {
  const bool driven = agent.trainee || agent.definition.behaviour.kind == BehaviourKind::teleop;
  if (!around.options.radio || !driven) return;
  const Radio& radio = *around.options.radio;
  const Eigen::Vector3d antenna = motion.T_map_base * Eigen::Vector3d(0, 0, agent.form.size.z());
  const int walls =
      crossing(around.building(), around.environment.doors.all(), radio.position, antenna).walls;
  const double power = received_power(radio, (antenna - radio.position).norm(), walls);
  RobotSupply& supply = agent.supply;
  supply.radio_power = power;
  const bool lost = power < radio.sensitivity + (supply.radio_lost ? radio.restore : 0);
  if (lost == supply.radio_lost) return;
  supply.radio_lost = lost;
  events.push_back(
      event_of(lost ? EventKind::radio_lost : EventKind::radio_restored, agent.watch.body(), motion, power));
}

void watch_battery(Agent& agent, const ObservedMotion& motion, const Surroundings& around,
                   const Physics& physics, std::vector<Event>& events) {
  RobotSupply& supply = agent.supply;
  if (!around.options.battery || supply.empty || around.clock.waiting) return;
  const Battery& battery = *around.options.battery;
  const Joints& joints = agent.robot->motion().joints;
  double work = 0;
  for (std::size_t i = 0; i < joints.velocities.size() && i < joints.efforts.size(); ++i)
    work += std::max(0.0, joints.velocities[i] * joints.efforts[i]);
  supply.used += around.clock.dt * battery_power(battery, agent.robot->mass(), motion.velocity.norm(),
                                                 agent.robot->drive_power(physics), work);
  const double left = std::max(0.0, battery.charge - supply.used / battery.capacity);
  if (left <= battery.low && !supply.low) {
    supply.low = true;
    events.push_back(event_of(EventKind::battery_low, agent.watch.body(), motion, left));
  }
  if (left > 0) return;
  supply.empty = true;
  agent.robot->hold(physics);
  events.push_back(event_of(EventKind::battery_empty, agent.watch.body(), motion, 0));
}

SupplyState supply_state(const Agent* agent, const std::optional<Battery>& battery) {
  SupplyState state;
  if (!agent || !agent->robot) return state;
  state.radio_power = agent->supply.radio_power;
  state.radio_lost = agent->supply.radio_lost;
  state.battery_empty = agent->supply.empty;
  if (battery) state.battery_left = std::max(0.0, battery->charge - agent->supply.used / battery->capacity);
  return state;
}

}  // namespace parhelion::simulation
