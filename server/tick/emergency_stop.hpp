// Emergency stop of the trainee's robot, simulated or real: MR_EMERGENCY_STOP stops it, whoever drives it,
// until MR_EMERGENCY_STOP releases it and the dead-man was released.
#pragma once

#include "protocols/bus/bus.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::tick {

/// The command is for the trainee's robot, not for an agent.
inline bool is_for_trainee(const Configuration& configuration, const EmergencyStopCommand& command) {
  return command.robot.empty() || command.robot == configuration.robot.name;
}

/// The message stops the trainee's robot: applied even where the log cannot be written.
bool stops_robot(const Configuration& configuration, const Message& message);

/// The message that stops it, as if it had come at `now`.
Message emergency_stop_message(const Configuration& configuration, ArrivalTime now);

}  // namespace parhelion::tick
