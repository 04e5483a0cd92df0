// Checks whether an agent may be spawned: its name, its model and its behaviour.
#pragma once

#include <memory>
#include <string>

#include "protocols/agent.hpp"
#include "protocols/status.hpp"
#include "server/simulation/bodies/agents.hpp"
#include "server/simulation/bodies/real_robot.hpp"
#include "server/simulation/building/building.hpp"
#include "server/simulation/world/simulation_options.hpp"

namespace parhelion::simulation {

/// Looks up a robot model in the library; nullptr: not found.
std::shared_ptr<const RobotModel> find_model(const std::string& name, const SimulationOptions& options);

/// Physical form of a definition, with or without a robot model.
AgentForm form_of(const AgentDefinition& agent, const SimulationOptions& options);

/// Checks everything except the pose. `trainee`: the name may be the real robot's.
Status check_definition(const AgentDefinition& agent, bool trainee, const SimulationOptions& options,
                        const Building& building, const Agents& agents, const RealRobots& real_robots);

/// Checks that the agent supports the behaviour, with valid speeds, distances and waypoints.
Status check_behaviour(const AgentDefinition& agent, const SimulationOptions& options,
                       const Building& building);

}  // namespace parhelion::simulation
