// Velocity commands.
#pragma once

#include <cstdint>

#include "protocols/frames.hpp"
#include "protocols/time.hpp"

namespace parhelion {

enum class CommandType : std::uint8_t { twist /* twist2D_t */, mbot_motor /* mbot_motor_command_t */ };

/// A velocity command from a trainee (TELEOP) or to a robot (MR_CMD): in the body frame.
struct TwistCommand {
  SensorTime stamp;
  Twist2 twist;
  CommandType type =
      CommandType::twist;  ///< how it is on the wire; sideways motion is lost in a motor command
};

}  // namespace parhelion
