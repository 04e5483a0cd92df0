// An emergency stop of the trainee's robot, simulated or real: MR_EMERGENCY_STOP holds it, whoever drives it,
// until MR_EMERGENCY_STOP releases it and the dead-man was let go.
#pragma once

#include "protocols/bus/bus.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::tick {

/// Of the trainee's robot, not of an agent.
inline bool is_for_trainee(const Configuration& configuration, const EmergencyStopCommand& command) {
  return command.robot.empty() || command.robot == configuration.robot.name;
}

/// Stops it: obeyed even where nothing can be written down.
bool stops_robot(const Configuration& configuration, const Message& message);

/// The message that stops it, as if it had come at `now`.
Message stop_of_robot(const Configuration& configuration, ArrivalTime now);

}  // namespace parhelion::tick
