#include "fusion/pose/odometry/odometry_correction.hpp"

namespace parhelion::pose {

Pose2 corrected_step(const OdometryCorrection& correction, const Pose2& step) {
  const Twist2 raw = twist_to(step);
  const double forward = correction.translation_scale * raw.vx;
  return moved({forward, correction.translation_scale * raw.vy,
                correction.rotation_scale * raw.wz + correction.curvature * forward},
               1);
}

Pose2 raw_step(const OdometryCorrection& correction, const Pose2& true_step) {
  const Twist2 twist = twist_to(true_step);
  return moved({twist.vx / correction.translation_scale, twist.vy / correction.translation_scale,
                (twist.wz - correction.curvature * twist.vx) / correction.rotation_scale},
               1);
}

Odometry CorrectedOdometry::operator()(const Odometry& odometry) {
  const Pose2 raw = planar(odometry.T_odom_base);
  if (correction_ == OdometryCorrection{} || !raw.finite()) return odometry;
  const Pose2 corrected =
      last_ ? last_->corrected * corrected_step(correction_, last_->raw.inverse() * raw) : raw;
  last_ = Last{raw, corrected};
  return {odometry.stamp + seconds(correction_.time_offset), transform<Odom, Base>(corrected)};
}

}  // namespace parhelion::pose
