// Whether the scans of a real robot have stopped: it drives blind then, and is stopped.
#pragma once

#include <optional>

#include "protocols/robot.hpp"
#include "protocols/time.hpp"

namespace parhelion::tick {

/// Of a robot's first laser; a further one that falls silent degrades itself alone. By arrivals.
class ScanSilence {
 public:
  explicit ScanSilence(const RobotDescription& robot);
  /// A scan arrived, good or bad.
  void add(SimulationTime arrival);
  /// True where no scan has come for a second and for three of the usual periods. False before the third
  /// scan: a robot without a laser sends none.
  bool silent(SimulationTime now) const;

 private:
  double period_ = 0;  ///< s, the usual one; 0: not known yet
  int intervals_ = 0;  ///< between scans
  std::optional<SimulationTime> last_;
};

}  // namespace parhelion::tick
