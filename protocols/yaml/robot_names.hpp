// Names of enumerators in the YAML of a robot description, in the order of the enumerators.
#pragma once

#include <array>

namespace parhelion {

inline constexpr std::array<const char*, 2> kLensNames{"radial_tangential", "fisheye"};
inline constexpr std::array<const char*, 2> kVelocityFrameNames{"body", "local"};
inline constexpr std::array<const char*, 2> kCommandTypeNames{"twist2D_t", "mbot_motor_command_t"};

}  // namespace parhelion
