// People who walk along with the robot. Where it drives most of a metre between two scans, their returns look
// like those of a place that it has not left, and in a corridor little else shows its motion.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <vector>

#include "fusion/pose/matching/scan_points.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// A companion walks along with the robot: something as wide as a person, in front of its background, that is
/// at the same place relative to the robot as some 0.4 m of path ago, although the robot has moved on. As
/// evidence, its present place was free then, or its former place is free now. Odometry is taken to be right.
class Companions {
 public:
  /// The scan without companions. If they would be a large part of it, odometry is wrong instead, and the
  /// whole scan is returned. `odometry`: motion of the base since the previous scan.
  ScanPoints without(const ScanPoints& scan, const Pose2& odometry);
  void forget();

 private:
  /// Neighbouring points, in the order of the beams.
  struct Thing {
    std::size_t begin = 0, end = 0;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();  ///< m, base_link at the scan
  };
  struct PastScan {
    SensorTime stamp;
    Pose2 T_local_base;
    Eigen::Vector2d laser = Eigen::Vector2d::Zero();  ///< m, base_link at the scan
    std::vector<double> nearest;                      ///< m, in each direction from the laser; 0: no return
    std::vector<Thing> things;
  };
  static std::vector<Thing> things_of(const ScanPoints& scan);
  PastScan described(const ScanPoints& scan) const;
  const PastScan* some_path_before(SensorTime stamp) const;
  static bool is_free(const PastScan& seen, const Eigen::Vector2d& p);
  static bool is_gone(const PastScan& now, const Eigen::Vector2d& p, const Pose2& T_then_now);
  std::vector<Thing> companions_in(const PastScan& now) const;

  std::deque<PastScan> past_;  ///< of the last seconds, their stamps ascend
  Pose2 T_local_base_;         ///< by odometry
};

}  // namespace parhelion::pose
