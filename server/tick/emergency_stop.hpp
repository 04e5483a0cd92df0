// An emergency stop of the trainee's robot, simulated or real: MR_AGENT_CMD freezes it, whoever drives it,
// until MR_AGENT_CMD unfreezes it and the dead-man was let go.
#pragma once

#include "protocols/bus/bus.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::tick {

/// Stops it, or takes the stop back.
inline bool is_emergency_stop(const Configuration& configuration, const AgentCommand& command) {
  using Action = AgentCommand::Action;
  return (command.action == Action::freeze || command.action == Action::unfreeze) &&
         command.agent.name == configuration.robot.name;
}

/// Stops it: obeyed even where nothing can be written down.
bool stops_robot(const Configuration& configuration, const Message& message);

/// The command that stops it, as if it had come at `now`.
Message stop_of_robot(const Configuration& configuration, ArrivalTime now);

}  // namespace parhelion::tick
