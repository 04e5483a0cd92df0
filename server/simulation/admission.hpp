// Whether an agent may be: its name, its model and what it is to do.
#pragma once

#include <memory>
#include <string>

#include "protocols/command.hpp"
#include "protocols/status.hpp"
#include "server/simulation/agents.hpp"
#include "server/simulation/building.hpp"
#include "server/simulation/real_robot.hpp"

namespace parhelion::simulation {

/// Of the library of robot models; nullptr: there is no such model.
std::shared_ptr<const RobotModel> find_model(const std::string& name, const SimulationOptions& options);

/// Of a definition that may have a robot model.
AgentForm form_of(const AgentDefinition& agent, const SimulationOptions& options);

/// All but its place. `trainee`: it may have the real robot's name.
Status check_definition(const AgentDefinition& agent, bool trainee, const SimulationOptions& options,
                        const Building& building, const Agents& agents, const RealRobots& real_robots);

/// Whether the agent can do that, at speeds, distances and waypoints that make sense.
Status check_behaviour(const AgentDefinition& agent, const SimulationOptions& options,
                       const Building& building);

}  // namespace parhelion::simulation
