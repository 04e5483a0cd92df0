// One scan of a planar laser, as the tracker takes it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "fusion/scan/ray_caster.hpp"
#include "protocols/scan.hpp"
#include "protocols/time.hpp"

namespace parhelion::people {

/// A real robot other than the one that carries the laser.
struct KnownRobot {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();  ///< m, map
  double radius = 0;                                 ///< m, contains it
};

struct LaserSweep {
  std::size_t laser = 0;  ///< index of the laser: what was seen free is kept for each by itself
  const Scan& scan;       ///< as received
  const LaserDescription& description;
  scan::LaserMotion motion;
  std::span<const float> beam_time;  ///< per beam, 0 at the sweep's start, 1 at its end
  /// The modelled building on the same beams; empty: no model.
  std::span<const scan::RangeHit> building;
  double sigma = 0;      ///< m, 1 sigma of a return's position in the map, without the laser's noise
  SimulationTime stamp;  ///< of the sweep's middle; not before that of the previous call
  std::span<const KnownRobot> robots;
};

}  // namespace parhelion::people
