// Publishes the results of a simulation step on MR_EVENTS, MR_WORLD and HAZARD.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "protocols/codec.hpp"
#include "protocols/world.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/clock_offset.hpp"
#include "server/tick/dose.hpp"
#include "server/tick/hazard_sensor.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// Kinds of the agents and of the trainee's simulated robot, by name.
using AgentKinds = std::map<std::string, AgentKind>;

struct WorldState {
  AgentKinds kinds;
  std::uint64_t steps = 0;            ///< since the start
  std::uint64_t scene_published = 0;  ///< scene version in the last MR_WORLD
  WorldSnapshot snapshot;             ///< scratch
  WorldMessage message;               ///< scratch
};

void publish_simulation_events(const TickContext& context, simulation::Simulation& simulation);
/// Publishes MR_WORLD 30 times a second and at each change of the scene; the grader receives it too.
void publish_world(const TickContext& context, const simulation::Simulation& simulation, WorldState& world);
/// What a robot carries to measure hazards.
struct HazardMeters {
  HazardResponse sensor;
  DoseMeter dose;
};

/// Publishes HAZARD, the events of doses, and radio and battery for MR_STATUS, ten times a second. `clock`
/// and `meters`: the robot's. `waiting`: for the start of the training, so that doses do not grow.
void publish_hazards(const TickContext& context, const ClockOffset& clock, simulation::Simulation& simulation,
                     const WorldState& world, bool waiting, HazardMeters& meters);

}  // namespace parhelion::tick
