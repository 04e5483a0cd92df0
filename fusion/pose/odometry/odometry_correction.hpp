// Removes the known systematic errors of odometry, sample by sample.
#pragma once

#include <optional>

#include "protocols/pose.hpp"
#include "protocols/pose2.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

/// A step of odometry between two instants, corrected; the step is taken as an arc of constant twist.
Pose2 corrected_step(const OdometryCorrection& correction, const Pose2& step);
/// The inverse: what odometry with these errors says of a true step.
Pose2 raw_step(const OdometryCorrection& correction, const Pose2& true_step);

/// Converts samples of ODOMETRY to what an odometry without these errors would have published: stamps on the
/// clock of the scans, poses summed up from corrected steps. Without a correction, samples pass unchanged.
class CorrectedOdometry {
 public:
  explicit CorrectedOdometry(const OdometryCorrection& correction = {}) : correction_(correction) {}

  /// A sample that is not finite passes unchanged and is not summed up.
  Odometry operator()(const Odometry& odometry);

 private:
  struct Last {
    Pose2 raw, corrected;  ///< T_odom_base
  };
  OdometryCorrection correction_;
  std::optional<Last> last_;
};

}  // namespace parhelion::pose
