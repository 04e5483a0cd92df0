// The one place that reads a clock: for the inbox's stamps and for measuring durations.
#pragma once

#include <chrono>

#include "protocols/time.hpp"

namespace parhelion::runtime {

/// Since the epoch; may be set by an administrator.
inline WallTime wall_now() {
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(
              std::chrono::system_clock::now().time_since_epoch())
              .count()};
}

/// For durations only: never goes back.
inline WallTime steady_now() {
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(
              std::chrono::steady_clock::now().time_since_epoch())
              .count()};
}

}  // namespace parhelion::runtime
