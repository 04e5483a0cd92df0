// The status of operators' consoles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "protocols/time.hpp"

namespace parhelion {

inline constexpr std::size_t kMaxOperatorName = 40;  ///< bytes

/// Status of a console (channel OPERATOR): at each change, and at least twice a second.
struct OperatorStatus {
  enum class State : std::uint8_t { drives, ended, lost };
  SensorTime stamp;   ///< when it was sent, the console's clock
  std::string name;   ///< of the operator: 1 to kMaxOperatorName letters, digits, '_' and '-'
  std::string robot;  ///< driven by the operator: the trainee's, or an agent
  State state = State::drives;
  std::string text;  ///< name of the console, or why it was lost
};

}  // namespace parhelion
