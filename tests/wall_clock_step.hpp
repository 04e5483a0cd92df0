// A wall clock that is set, for a whole test program: clock_gettime(2) of CLOCK_REALTIME adds the steps.
#pragma once

#include "protocols/time.hpp"

namespace parhelion::test {

/// Sets the wall clock forward until destruction. Monotonic clocks do not change.
class WallClockStep {
 public:
  explicit WallClockStep(Duration forward);
  ~WallClockStep();
  WallClockStep(const WallClockStep&) = delete;
  WallClockStep& operator=(const WallClockStep&) = delete;

 private:
  const Duration forward_;
};

}  // namespace parhelion::test
