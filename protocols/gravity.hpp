// The acceleration of gravity.
#pragma once

namespace parhelion {

inline constexpr double kGravity = 9.81;  ///< m/s^2

}  // namespace parhelion
