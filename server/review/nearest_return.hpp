// Smallest distance between the robot's outline and the laser returns of a scan, injected returns included.
#pragma once

#include <vector>

#include "protocols/robot.hpp"
#include "protocols/telemetry.hpp"

namespace parhelion::review {

class NearestReturn {
 public:
  /// The description must outlive it. Without a laser or a footprint all distances are infinite.
  explicit NearestReturn(const RobotDescription& description);

  struct Distances {
    double any = 0;       ///< m in the plane, from the edge of the footprint, 0 inside it; infinity: no
                          ///< return
    double injected = 0;  ///< the same for injected returns only
  };
  /// `info`: of the same stamp; nullptr: no beam counts as injected.
  Distances of(const Scan& scan, const ScanInfo* info);
  bool knows() const { return robot_.laser && robot_.footprint.size() >= 3; }

 private:
  const RobotDescription& robot_;
  double reach_ = 0;  ///< m, from the laser to the footprint's farthest corner
  float angle_min_ = 0, angle_increment_ = 0;
  std::vector<Eigen::Vector2d> directions_;  ///< of beams, in base_link
};

/// m from p to a convex counter-clockwise outline; 0 inside.
double distance_to_outline(const Eigen::Vector2d& p, const std::vector<Eigen::Vector2d>& outline);

}  // namespace parhelion::review
