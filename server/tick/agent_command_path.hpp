// MR_AGENT_CMD: what the instructor does with agents and doors, with faults and scripts, and the trainee's
// reports and emergency stop. Each command is answered by an event.
#pragma once

#include "protocols/bus/bus.hpp"
#include "protocols/command.hpp"
#include "server/tick/agent_cameras.hpp"
#include "server/tick/command_path.hpp"
#include "server/tick/fault_path.hpp"
#include "server/tick/model_path.hpp"
#include "server/tick/pose_path.hpp"
#include "server/tick/scripts.hpp"
#include "server/tick/tick_context.hpp"
#include "server/tick/world_path.hpp"

namespace parhelion::tick {

/// What a command about agents works on, the instructor's or a script's.
struct AgentPath {
  const PoseState& pose;  ///< of the robot that nothing may appear on
  AgentKinds& kinds;
  AgentCameras& cameras;
  simulation::Simulation& simulation;
};

/// What any command of MR_AGENT_CMD works on.
struct AgentCommandPath {
  AgentPath agents;
  CommandPath robot;
  Scripts& scripts;
  FaultState& faults;
  const SiteState& site;
};

void handle_agent_command(const TickContext& context, const Message& input, const AgentCommandPath& path);

/// Does the command, or says why not.
Status apply_agent_command(const TickContext& context, const AgentCommand& command, const AgentPath& path);

}  // namespace parhelion::tick
