// Read-only inputs of a step, for decisions, predictions and watches.
#pragma once

#include "server/simulation/bodies/agents.hpp"
#include "server/simulation/bodies/real_robot.hpp"
#include "server/simulation/bodies/step_clock.hpp"
#include "server/simulation/world/environment.hpp"
#include "server/simulation/world/neighbours.hpp"
#include "server/simulation/world/simulation_options.hpp"

namespace parhelion::simulation {

struct Surroundings {
  const SimulationOptions& options;
  const StepClock& clock;
  const Environment& environment;
  const RealRobots& real_robots;
  const Agents& agents;
  const Neighbours& neighbours;  ///< of agents, by index

  const Building& building() const { return *environment.building; }
};

}  // namespace parhelion::simulation
