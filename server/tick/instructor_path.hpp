// The instructor's commands for agents, doors, faults, scripts and cameras; the trainee's reports and
// emergency stop. Each is answered by an event.
#pragma once

#include "protocols/bus/bus.hpp"
#include "protocols/instructor_command.hpp"
#include "server/tick/agent_cameras.hpp"
#include "server/tick/command_path.hpp"
#include "server/tick/fault_path.hpp"
#include "server/tick/model_path.hpp"
#include "server/tick/pose_path.hpp"
#include "server/tick/scripts.hpp"
#include "server/tick/start_path.hpp"
#include "server/tick/tick_context.hpp"
#include "server/tick/world_path.hpp"

namespace parhelion::tick {

/// Dependencies of commands about agents, the instructor's or a script's.
struct AgentPath {
  const RealRobots& real;  ///< the trainees' robots, on which nothing may appear
  AgentKinds& kinds;
  AgentCameras& cameras;
  simulation::Simulation& simulation;
};

/// Dependencies of all instructor commands.
struct InstructorPath {
  AgentPath agents;
  std::vector<CommandPath> robots;  ///< by index
  Scripts& scripts;
  FaultState& faults;
  const SiteState& site;
  StartPath start;
};

void handle_instructor_command(const TickContext& context, const Message& input, const InstructorPath& path);

/// The reply to a command that was refused before it was read, as the server is behind.
void refuse_late_command(const TickContext& context, std::uint64_t request);

/// Applies the command. Error: the reason why not.
Status apply_agent_command(const TickContext& context, const AgentCommand& command, const AgentPath& path);

}  // namespace parhelion::tick
