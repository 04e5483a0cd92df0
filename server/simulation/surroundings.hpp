// Read-only inputs of a step, for decisions, predictions and watches.
#pragma once

#include "server/simulation/agents.hpp"
#include "server/simulation/environment.hpp"
#include "server/simulation/neighbours.hpp"
#include "server/simulation/real_robot.hpp"
#include "server/simulation/simulation.hpp"
#include "server/simulation/step_clock.hpp"

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
