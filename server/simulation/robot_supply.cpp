#include "server/simulation/robot_supply.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/simulation/state.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kGravity = 9.81;            // m/s^2
constexpr double kLightSpeed = 299'792'458;  // m/s

}  // namespace

double received_power(const Radio& radio, double distance, int walls) {
  const double at_one_metre = 20 * std::log10(4 * std::numbers::pi * radio.frequency / kLightSpeed);
  const double farther = 10 * radio.exponent * std::log10(std::max(1.0, distance));
  return radio.power - at_one_metre - farther - radio.wall_loss * walls;
}

double battery_power(const Battery& battery, double mass, double speed, double drive, double joints) {
  const double rolling = battery.rolling * mass * kGravity * std::abs(speed);
  return battery.idle + (std::max(0.0, drive) + std::max(0.0, joints) + rolling) / battery.efficiency;
}

void Simulation::State::watch_radio(Agent& agent, const ObservedMotion& motion) {
  const bool driven = agent.trainee || agent.definition.behaviour.kind == BehaviourKind::teleop;
  if (!options.radio || !driven) return;
  const Radio& radio = *options.radio;
  const Eigen::Vector3d antenna = motion.T_map_base * Eigen::Vector3d(0, 0, agent.form.size.z());
  const int walls = crossing(*building, doors, radio.position, antenna).walls;
  const double power = received_power(radio, (antenna - radio.position).norm(), walls);
  RobotSupply& supply = agent.supply;
  supply.radio_power = power;
  const bool lost = power < radio.sensitivity + (supply.radio_lost ? radio.restore : 0);
  if (lost == supply.radio_lost) return;
  supply.radio_lost = lost;
  events.push_back(
      event_of(lost ? EventKind::radio_lost : EventKind::radio_restored, agent.watch.body(), motion, power));
}

void Simulation::State::watch_battery(Agent& agent, const ObservedMotion& motion) {
  RobotSupply& supply = agent.supply;
  if (!options.battery || supply.empty) return;
  const Battery& battery = *options.battery;
  const Joints& joints = agent.robot->motion().joints;
  double work = 0;
  for (std::size_t i = 0; i < joints.velocities.size() && i < joints.efforts.size(); ++i)
    work += std::max(0.0, joints.velocities[i] * joints.efforts[i]);
  supply.used += dt * battery_power(battery, agent.robot->mass(), motion.velocity.norm(),
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

SupplyState Simulation::supply_of(const std::string& name) const {
  SupplyState state;
  const Agent* agent = state_->find(name);
  if (!agent || !agent->robot) return state;
  state.radio_power = agent->supply.radio_power;
  state.radio_lost = agent->supply.radio_lost;
  state.battery_empty = agent->supply.empty;
  if (state_->options.battery)
    state.battery_left = std::max(
        0.0, state_->options.battery->charge - agent->supply.used / state_->options.battery->capacity);
  return state;
}

}  // namespace parhelion::simulation
