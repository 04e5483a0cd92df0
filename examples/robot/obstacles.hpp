// Obstacles around the robot, from scans.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry.hpp"
#include "parhelion/planar_lidar_t.hpp"

namespace robot {

// Ends of the beams that met something within `range_max`, in base_link.
std::vector<Point2> points_of(const parhelion::planar_lidar_t& scan, const Pose2& T_base_laser,
                              double range_max);

// The robot's own obstacle stop. It reads its own laser, so that it stops for real obstacles whatever
// Parhelion does, and MR_SCAN, so that it stops for virtual ones, too.
class ObstacleStop {
 public:
  static constexpr std::int64_t kSilence = 500'000;  // us without a scan: stop
  static constexpr double kMargin = 0.06;            // m around the footprint

  void see_real(const parhelion::planar_lidar_t& scan, std::int64_t now);
  void see_augmented(const parhelion::planar_lidar_t& scan, std::int64_t now);

  // The largest fraction of `command` after which the robot can still brake before it touches something.
  // Motion away from an obstacle is not reduced.
  double allowed(const Twist2& command, std::int64_t now) const;
  // Whether both scans are there.
  bool sees(std::int64_t now) const;

 private:
  bool is_free(const Twist2& command) const;
  struct Seen {
    std::vector<Point2> points;  // base_link
    std::int64_t at = -kSilence;
  };
  Seen real_, augmented_;
};

}  // namespace robot
