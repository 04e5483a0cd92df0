#include "server/simulation/events/hazards.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace parhelion::simulation {
namespace {

constexpr double kSameStorey =
    1.5;  // m, height difference between a device and the floor of an approaching body

/// Position of a hazard, whose agent, if any, exists.
Eigen::Vector3d place_of(const Hazard& hazard, const Agents& agents) {
  if (hazard.agent.empty()) return hazard.position;
  const Agent* agent = agents.find(hazard.agent);
  return agent->rigid.T_map_body * Eigen::Vector3d(0, 0, agent->form.size.z() / 2);
}

}  // namespace

Hazards::Hazards(const std::vector<Hazard>& hazards, const Building& building) {
  for (const Hazard& hazard : hazards) {
    Entry& entry = entries_.emplace_back(Entry{hazard});
    if (hazard.kind == HazardKind::gas && hazard.agent.empty())
      entry.gas.place(building, hazard.position, hazard.reach);
  }
}

void Hazards::forget_fields() {
  for (Entry& entry : entries_) entry.gas = GasField();
}

/// Triggers that a device feels as an agent: a blow changes its momentum, a tilt its attitude.
Hazards::Trigger Hazards::felt(Entry& entry, const Agent& agent) {
  const Hazard& hazard = entry.hazard;
  const Eigen::Vector3d& v = agent.rigid.velocity;
  if (entry.epoch != agent.epoch) entry.velocity = {v, v};
  // The physics spreads a blow over two steps: the first one closes the gap.
  const double blow = agent.form.mass * (v - entry.velocity[0]).norm();
  entry.epoch = agent.epoch;
  entry.velocity = {entry.velocity[1], v};
  if (hazard.shock && blow >= *hazard.shock) return {"shock", blow};
  const Eigen::Matrix3d R = agent.rigid.T_map_body.rotation();
  const double tilt = std::atan2(std::hypot(R(2, 0), R(2, 1)), R(2, 2));
  if (hazard.tilt && tilt >= *hazard.tilt) return {"tilt", tilt};
  return {};
}

/// Triggered by the nearest robot or person within the device's reach.
Hazards::Trigger Hazards::approached(const Entry& entry, const Agent* own, const Eigen::Vector3d& place,
                                     const Surroundings& around) {
  if (!entry.hazard.nearness) return {};
  Trigger trigger;
  trigger.value = *entry.hazard.nearness;
  const Footprint at = own != nullptr ? own->placed : make_disc(place.head<2>(), 0);
  const auto consider = [&](const Footprint& placed, double z, const std::string& name, PairKind pair,
                            bool undetectable) {
    if (std::abs(z - place.z()) > kSameStorey || distance_bound(placed, at) > trigger.value) return;
    const double distance = std::max(0.0, signed_distance(placed, at));
    if (distance > trigger.value || (!trigger.who.empty() && distance == trigger.value)) return;
    trigger = {"nearness", distance, name, pair, undetectable};
  };
  for (const RealRobot& robot : around.real_robots) {
    if (robot.present)
      consider(robot.placed, robot.last.T_map_base.translation().z(), robot.name, PairKind::real_virtual,
               !robot.injection_live);
  }
  for (const Agent& agent : around.agents) {
    if (&agent == own || !agent.form.upright) continue;
    consider(agent.placed, agent.rigid.T_map_body.translation().z(), agent.definition.name,
             agent.trainee ? PairKind::real_virtual : PairKind::virtual_virtual, false);
  }
  return trigger;
}

void Hazards::update(const Surroundings& around, std::vector<Event>& events) {
  for (Entry& entry : entries_) {
    const Hazard& hazard = entry.hazard;
    if (hazard.kind != HazardKind::device || entry.triggered) continue;
    const Agent* agent = hazard.agent.empty() ? nullptr : around.agents.find(hazard.agent);
    if (!hazard.agent.empty() && agent == nullptr) {
      entry.epoch.reset();
      continue;
    }
    Trigger trigger;
    if (agent != nullptr) trigger = felt(entry, *agent);
    const Eigen::Vector3d place = place_of(hazard, around.agents);
    if (trigger.by == nullptr) trigger = approached(entry, agent, place, around);
    const double age = around.clock.waiting ? 0 : (around.clock.now() - around.clock.begun).seconds();
    if (trigger.by == nullptr && hazard.delay && age >= *hazard.delay) trigger = {"time", age};
    if (trigger.by == nullptr) continue;
    entry.triggered = true;
    Event event;
    event.stamp = around.clock.now();
    event.kind = EventKind::hazard_triggered;
    event.subject = hazard.name;
    event.object = trigger.who;
    event.pair = trigger.pair;
    event.undetectable = trigger.undetectable;
    event.position = place;
    event.value = trigger.value;
    event.text = trigger.by;
    events.push_back(std::move(event));
  }
}

bool Hazards::has(HazardKind kind) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const Entry& entry) { return entry.hazard.kind == kind; });
}

/// The sum of the sources of one kind at p.
double Hazards::read_sources(HazardKind kind, const Eigen::Vector3d& p, const Surroundings& around) {
  const Building& building = around.building();
  double sum = 0;
  for (Entry& entry : entries_) {
    const Hazard& hazard = entry.hazard;
    if (hazard.kind != kind || (!hazard.agent.empty() && around.agents.find(hazard.agent) == nullptr))
      continue;
    const Eigen::Vector3d place = place_of(hazard, around.agents);
    if (kind == HazardKind::radiation) {
      const Crossing walls = crossing(building, around.environment.doors.all(), place, p);
      sum += dose_rate(hazard, (p - place).norm(), walls.thickness);
    } else {
      entry.gas.place(building, place, hazard.reach);
      sum += entry.gas.concentration(building, hazard.strength, p);
    }
  }
  return sum;
}

bool Hazards::read(const Surroundings& around, std::size_t robot, HazardReading& reading) {
  reading.values.clear();
  if (!has(HazardKind::radiation) && !has(HazardKind::gas)) return false;
  Eigen::Vector3d sensor;
  const RealRobot& real = around.real_robots[robot];
  const Agent* trainee = around.agents.trainee();
  if (real.present) {
    sensor = real.last.T_map_base * Eigen::Vector3d(0, 0, real.height);
  } else if (trainee != nullptr) {
    sensor = trainee->rigid.T_map_body * Eigen::Vector3d(0, 0, trainee->form.size.z());
  } else {
    return false;
  }
  for (const HazardKind kind : {HazardKind::radiation, HazardKind::gas}) {
    if (!has(kind)) continue;
    reading.values.push_back(
        {kind, read_sources(kind, sensor, around), kind == HazardKind::gas ? "ppm" : "uSv/h"});
  }
  return true;
}

}  // namespace parhelion::simulation
