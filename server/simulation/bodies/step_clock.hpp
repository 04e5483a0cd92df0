// The fixed steps of a simulation: their length, their number and their instants.
#pragma once

#include <cstdint>

#include "protocols/time.hpp"

namespace parhelion::simulation {

struct StepClock {
  StepClock(SimulationTime at_start, double steps_per_second)
      : start(at_start), begun(at_start), rate(steps_per_second), dt(1 / steps_per_second) {}

  SimulationTime start;
  SimulationTime begun;    ///< timers count from here
  bool waiting = false;    ///< agents and timers stand still until begin()
  double rate;             ///< Hz
  double dt;               ///< s
  std::uint64_t step = 0;  ///< the newest

  SimulationTime stamp_of(std::uint64_t number) const {
    return start + seconds(static_cast<double>(number) / rate);
  }
  void begin() {
    waiting = false;
    begun = now();
  }
  SimulationTime now() const { return stamp_of(step); }
  /// Whole steps in `duration` s.
  std::uint64_t steps_in(double duration) const { return static_cast<std::uint64_t>(duration * rate); }
};

}  // namespace parhelion::simulation
