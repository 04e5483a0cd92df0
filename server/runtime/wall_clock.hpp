// The only place that reads a clock: for the inbox's stamps and for measuring durations.
#pragma once

#include <chrono>

#include "protocols/time.hpp"

namespace parhelion::runtime {

/// Time since the epoch; an administrator may set this clock.
inline WallTime wall_now() {
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(
              std::chrono::system_clock::now().time_since_epoch())
              .count()};
}

/// Monotonic; for durations only.
inline WallTime steady_now() {
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(
              std::chrono::steady_clock::now().time_since_epoch())
              .count()};
}

}  // namespace parhelion::runtime
