#pragma once

#include <numbers>

namespace parhelion::test {

inline constexpr double kDegree = std::numbers::pi / 180;  ///< rad

}  // namespace parhelion::test
