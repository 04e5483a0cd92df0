// Devices that are set off at a step, and what the hazard sensor reads.
#include <algorithm>
#include <cmath>

#include "server/simulation/state.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kSameStorey = 1.5;  // m between a device and the floor of who comes near

/// What set a device off.
struct Trigger {
  const char* by = nullptr;  ///< nullptr: nothing did
  double value = 0;
  std::string who = {};
  PairKind pair = PairKind::none;
  bool unsensed = false;
};

/// Of the agent that a device is: a blow changes its momentum, a tilt its attitude.
Trigger felt(const Hazard& hazard, const Agent& agent, HazardState& state) {
  const Eigen::Vector3d& v = agent.rigid.velocity;
  if (state.epoch != agent.epoch) state.velocity = {v, v};
  // The physics spreads a blow over two steps: in the first one the gap closes.
  const double blow = agent.form.mass * (v - state.velocity[0]).norm();
  state.epoch = agent.epoch;
  state.velocity = {state.velocity[1], v};
  if (hazard.shock && blow >= *hazard.shock) return {"shock", blow};
  const Eigen::Matrix3d R = agent.rigid.T_map_body.rotation();
  const double tilt = std::atan2(std::hypot(R(2, 0), R(2, 1)), R(2, 2));
  if (hazard.tilt && tilt >= *hazard.tilt) return {"tilt", tilt};
  return {};
}

}  // namespace

Eigen::Vector3d Simulation::State::place_of(const Hazard& hazard) {
  if (hazard.agent.empty()) return hazard.position;
  const Agent* agent = find(hazard.agent);
  return agent->rigid.T_map_body * Eigen::Vector3d(0, 0, agent->form.size.z() / 2);
}

/// The nearest robot or person within its reach.
void Simulation::State::watch_nearness(const Hazard& hazard, const Eigen::Vector3d& place, double& nearest,
                                       std::string& who, PairKind& pair) {
  const Agent* own = hazard.agent.empty() ? nullptr : find(hazard.agent);
  const Footprint at = own != nullptr ? own->placed : make_disc(place.head<2>(), 0);
  const auto consider = [&](const Footprint& placed, double z, const std::string& name, PairKind its) {
    if (std::abs(z - place.z()) > kSameStorey || distance_bound(placed, at) > nearest) return;
    const double distance = std::max(0.0, signed_distance(placed, at));
    if (distance > nearest || (!who.empty() && distance == nearest)) return;
    nearest = distance;
    who = name;
    pair = its;
  };
  if (real.present)
    consider(real.placed, real.last.T_map_base.translation().z(), real.name, PairKind::real_virtual);
  for (const auto& agent : agents) {
    if (agent.get() == own || !agent->form.upright) continue;
    consider(agent->placed, agent->rigid.T_map_body.translation().z(), agent->definition.name,
             agent->trainee ? PairKind::real_virtual : PairKind::virtual_virtual);
  }
}

void Simulation::State::watch_hazards() {
  for (std::size_t i = 0; i < hazards.size(); ++i) {
    const Hazard& hazard = options.hazards[i];
    HazardState& state = hazards[i];
    if (hazard.kind != HazardKind::device || state.set_off) continue;
    const Agent* agent = hazard.agent.empty() ? nullptr : find(hazard.agent);
    if (!hazard.agent.empty() && agent == nullptr) {
      state.epoch.reset();
      continue;
    }
    Trigger trigger;
    if (agent != nullptr) trigger = felt(hazard, *agent, state);
    const Eigen::Vector3d place = place_of(hazard);
    if (trigger.by == nullptr && hazard.nearness) {
      double nearest = *hazard.nearness;
      watch_nearness(hazard, place, nearest, trigger.who, trigger.pair);
      if (!trigger.who.empty()) {
        trigger.by = "nearness";
        trigger.value = nearest;
        trigger.unsensed = real.present && trigger.who == real.name && !real.sensed;
      }
    }
    const double age = (stamp_of(step) - start).seconds();
    if (trigger.by == nullptr && hazard.delay && age >= *hazard.delay) trigger = {"time", age};
    if (trigger.by == nullptr) continue;
    state.set_off = true;
    Event event;
    event.stamp = stamp_of(step);
    event.kind = EventKind::hazard_set_off;
    event.subject = hazard.name;
    event.object = trigger.who;
    event.pair = trigger.pair;
    event.unsensed = trigger.unsensed;
    event.position = place;
    event.value = trigger.value;
    event.text = trigger.by;
    events.push_back(std::move(event));
  }
}

/// The sum of the sources of a kind at p.
double Simulation::State::read_sources(HazardKind kind, const Eigen::Vector3d& p) {
  double sum = 0;
  for (std::size_t i = 0; i < hazards.size(); ++i) {
    const Hazard& hazard = options.hazards[i];
    if (hazard.kind != kind || (!hazard.agent.empty() && find(hazard.agent) == nullptr)) continue;
    const Eigen::Vector3d place = place_of(hazard);
    if (kind == HazardKind::radiation) {
      sum += dose_rate(hazard, (p - place).norm(), crossing(*building, doors, place, p).thickness);
    } else {
      hazards[i].gas.place(*building, place, hazard.reach);
      sum += hazards[i].gas.concentration(*building, hazard.strength, p);
    }
  }
  return sum;
}

bool Simulation::hazard_reading(HazardReading& reading) {
  State& state = *state_;
  reading.values.clear();
  const auto has = [&](HazardKind kind) {
    return std::any_of(state.options.hazards.begin(), state.options.hazards.end(),
                       [&](const Hazard& hazard) { return hazard.kind == kind; });
  };
  if (!has(HazardKind::radiation) && !has(HazardKind::gas)) return false;
  Eigen::Vector3d sensor;
  const auto trainee = std::find_if(state.agents.begin(), state.agents.end(),
                                    [](const auto& agent) { return agent->trainee; });
  if (state.real.present) {
    sensor = state.real.last.T_map_base * Eigen::Vector3d(0, 0, state.real.height);
  } else if (trainee != state.agents.end()) {
    sensor = (*trainee)->rigid.T_map_body * Eigen::Vector3d(0, 0, (*trainee)->form.size.z());
  } else {
    return false;
  }
  for (const HazardKind kind : {HazardKind::radiation, HazardKind::gas}) {
    if (!has(kind)) continue;
    reading.values.push_back(
        {kind, state.read_sources(kind, sensor), kind == HazardKind::gas ? "ppm" : "uSv/h"});
  }
  return true;
}

}  // namespace parhelion::simulation
