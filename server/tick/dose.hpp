// Doses that a robot has received: rates and concentrations of hazards, summed over time.
#pragma once

#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/hazard.hpp"

namespace parhelion::tick {

/// One robot's, since the start of the session. It sums the true values: a dosimeter's own noise is small.
class DoseMeter {
 public:
  /// Adds `period` s of the values of `truth`, before a sensor's lag and noise. Appends an event for each
  /// limit that the dose reaches now, with neither stamp nor subject.
  void add(const HazardReading& truth, double period, const DoseLimits& limits, std::vector<Event>& events);
  /// Appends the doses of the kinds that `reading` has.
  void append_to(HazardReading& reading) const;

 private:
  double radiation_ = 0;  ///< uSv
  double gas_ = 0;        ///< ppm min
};

}  // namespace parhelion::tick
