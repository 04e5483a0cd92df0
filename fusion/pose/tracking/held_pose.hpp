// The pose after a match. Along directions that surfaces hardly determine it is held by odometry, as far as
// that has been right: there one scan after the other errs the same way, and the errors would add up.
#pragma once

#include "fusion/pose/matching/weak_directions.hpp"
#include "fusion/pose/odometry/odometry_belief.hpp"
#include "fusion/pose/tracking/scan_tracking.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

class HeldPose {
 public:
  struct Options {
    double strong_sigma = 0.02;  ///< m, as `sigma` of strong_directions()
    double renewed_after = 1;    ///< m, as `metres` of new_fraction()
  };
  HeldPose(const RobotDescription& robot, const Options& options)
      : robot_(robot), options_(options), belief_(robot.odometry_error_translation) {}

  /// `before`: at the previous scan. `step`: by odometry since then. A match that was not made about what
  /// odometry predicts is taken as it is.
  Estimate2 after(const Estimate2& before, const ScanTracking::Followed& found, const Pose2& step);

  bool is_odometry_good() const { return belief_.is_good(); }

 private:
  RobotDescription robot_;
  Options options_;
  OdometryBelief belief_;
};

}  // namespace parhelion::pose
