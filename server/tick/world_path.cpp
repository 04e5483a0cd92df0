#include "server/tick/world_path.hpp"

#include <algorithm>
#include <cmath>

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/tick/grading_path.hpp"

namespace parhelion::tick {
namespace {

constexpr double kWorldRate = 30;   // Hz of MR_WORLD, enough for display and grading
constexpr double kHazardRate = 10;  // Hz of HAZARD

/// Steps from one message to the next.
double steps_between(const Configuration& configuration, double rate) {
  return std::max(1.0, std::round(configuration.scenario.physics_rate / rate));
}

bool is_due(const Configuration& configuration, const WorldState& world, double rate) {
  return world.steps % static_cast<std::uint64_t>(steps_between(configuration, rate)) == 0;
}

AgentKind kind_of(const BodyDefinition& body, const AgentKinds& kinds) {
  if (body.owner == BodyOwner::real_person) return AgentKind::person;
  const auto kind = kinds.find(body.entity);
  return kind != kinds.end() ? kind->second : AgentKind::robot;
}

void publish_hazard_reading(const TickContext& context, const ClockOffset& clock,
                            simulation::Simulation& simulation, bool waiting, HazardMeters& meters) {
  HazardReading reading;
  if (!simulation.hazard_reading(reading, context.robot_index)) return;
  const Scenario& scenario = context.configuration.scenario;
  const double period = steps_between(context.configuration, kHazardRate) / scenario.physics_rate;
  std::vector<Event> reached;
  if (!waiting) meters.dose.add(reading, period, scenario.dose_limits, reached);
  for (Event& event : reached) {
    event.stamp = context.now;
    event.subject = context.robot().name;
    publish_event(context, event);
  }
  meters.sensor.measure(scenario.hazard_sensor, scenario.seed, period, reading);
  meters.dose.append_to(reading);
  reading.stamp = clock.known() ? clock.to_sensor(context.now) : SensorTime{context.now.ns};
  encode(reading, context.outputs.add(context.channel(channel::kHazard)));
}

}  // namespace

void publish_simulation_events(const TickContext& context, simulation::Simulation& simulation) {
  for (const Event& event : simulation.take_events()) publish_event(context, event);
}

void publish_world(const TickContext& context, const simulation::Simulation& simulation, WorldState& world) {
  if (!is_due(context.configuration, world, kWorldRate) &&
      simulation.scene()->version == world.scene_published)
    return;
  WorldSnapshot& now = world.snapshot;
  if (!simulation.at(context.now, now)) return;
  WorldMessage& message = world.message;
  message.stamp = {now.stamp.ns};
  message.step = now.step;
  message.robot = context.configuration.robot.name;
  for (const RobotDescription& other : context.configuration.other_robots) message.robot += " " + other.name;
  message.bodies.clear();
  for_each_body(now, [&](const BodyDefinition& definition, const BodyState& body) {
    // Bodies in the model are not sent, as MR_SESSION embeds it; except doors, which may have moved.
    if (definition.owner == BodyOwner::building && !(definition.moves && body.known)) return;
    message.bodies.push_back({definition.entity, definition.part, kind_of(definition, world.kinds),
                              definition.owner, body.attitude_known, body.epoch, body.T_map_body,
                              body.velocity, body.rotation_rate});
  });
  message.persons.clear();
  for (const simulation::RealPerson& person : simulation.real_people())
    message.persons.push_back({name_of(person), person.radius, person.covariance, person.seen});
  world.scene_published = now.scene->version;
  std::vector<std::uint8_t>& payload =
      context.outputs.add(context.configuration.channels.bus(channel::kMrWorld));
  encode(message, payload);
  if (context.listeners.grading != nullptr) grade_world(context, payload, *context.listeners.grading);
}

void publish_hazards(const TickContext& context, const ClockOffset& clock, simulation::Simulation& simulation,
                     const WorldState& world, bool waiting, HazardMeters& meters) {
  if (!is_due(context.configuration, world, kHazardRate)) return;
  publish_hazard_reading(context, clock, simulation, waiting, meters);
  if (!simulates_trainee(context.configuration.scenario)) return;
  const simulation::SupplyState supply = simulation.supply_of(context.configuration.robot.name);
  context.tally.radio_power = supply.radio_power;
  context.tally.battery_left = supply.battery_left;
}

}  // namespace parhelion::tick
