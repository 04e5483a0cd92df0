// The only place that reads a clock: for the inbox's stamps and for measuring durations.
#pragma once

#include <chrono>
#include <cstdint>
#include <ctime>

#include "protocols/time.hpp"

namespace parhelion::runtime {

/// Time since the epoch; an administrator may set this clock.
inline WallTime wall_now() {
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(
              std::chrono::system_clock::now().time_since_epoch())
              .count()};
}

/// Monotonic, and goes on while the machine sleeps: what waited meanwhile is old. For durations only.
inline WallTime steady_now() {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return {std::int64_t{1'000'000'000} * now.tv_sec + now.tv_nsec};
}

}  // namespace parhelion::runtime
