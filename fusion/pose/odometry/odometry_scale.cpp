#include "fusion/pose/odometry/odometry_scale.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace parhelion::pose {
namespace {

/// Of the way along a bare corridor as matches track it, 1 sigma: the newest scans pull the robot along with
/// the map, and their noise back. Chosen on generated corridors.
constexpr double kTrackedSigma = 0.02;

}  // namespace

void OdometryScale::add(SensorTime stamp, const Pose2& T_map_base, const Eigen::Matrix3d& information) {
  constexpr double regular = 1e-3;  // 1/m^2, 1/rad^2: a direction that nothing determines has no inverse
  calibration_.add(stamp, T_map_base, (information + regular * Eigen::Matrix3d::Identity()).inverse());
}

double OdometryScale::sigma() const {
  const double learned = calibration_.sigma()[1];
  return learned < first_sigma_ ? std::min(described_sigma_, learned) : described_sigma_;
}

double OdometryScale::tracked_sigma() const {
  return std::min(described_sigma_, std::hypot(sigma(), kTrackedSigma));
}

double OdometryScale::weight() const {
  const double ratio = sigma() / kTrackedSigma;
  return 1 / (1 + ratio * ratio);
}

ScanOdometry::Step OdometryScale::applied(const ScanOdometry::Step& reported) const {
  ScanOdometry::Step result = reported;
  const double by = scale();
  result.step = {by * reported.step.x, by * reported.step.y, reported.step.yaw};
  return result;
}

}  // namespace parhelion::pose
