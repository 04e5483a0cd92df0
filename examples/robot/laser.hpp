// The planar laser: a mirror that turns while the robot drives.
#pragma once

#include <cstdint>
#include <deque>
#include <random>

#include "building.hpp"
#include "parhelion/planar_lidar_t.hpp"

namespace robot {

// True poses of the last second, by the robot's clock.
class Track {
 public:
  void add(std::int64_t utime, const Pose2& T_site_base);
  // Interpolated; at the ends the nearest.
  Pose2 at(std::int64_t utime) const;

 private:
  struct Stamped {
    std::int64_t utime;  // us
    Pose2 T_site_base;
  };
  std::deque<Stamped> poses_;
};

// The scan whose first beam is measured at `utime`; the track must reach its last beam.
parhelion::planar_lidar_t measure_scan(const Building& building, const Track& track, std::int64_t utime,
                                       std::mt19937& random);

}  // namespace robot
