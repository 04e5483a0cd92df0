// Emergency stop of a trainee's robot, simulated or real: MR_EMERGENCY_STOP stops it, or all of them, whoever
// drives it, until MR_EMERGENCY_STOP releases it and the dead-man was released.
#pragma once

#include "protocols/bus/bus.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::tick {

/// The command is for trainees' robots, one or all, not for an agent.
inline bool is_for_trainee(const Configuration& configuration, const EmergencyStopCommand& command) {
  return command.robot.empty() || configuration.find_robot(command.robot);
}

/// The message stops a trainee's robot: applied even where the log cannot be written.
bool stops_robot(const Configuration& configuration, const Message& message);

/// The message that stops the robot of this name, as if it had come at `now`.
Message emergency_stop_message(const Configuration& configuration, const std::string& robot, ArrivalTime now);

}  // namespace parhelion::tick
