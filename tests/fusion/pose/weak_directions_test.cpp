// Along a corridor: matches that all err the same way, and odometry that is believed as far as it has been
// right.
#include "fusion/pose/matching/weak_directions.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "fusion/pose/odometry/odometry_belief.hpp"

namespace parhelion::pose {
namespace {

/// Information of points that determine x to `along` and y to `across` (m), and yaw to 0.002 rad.
Eigen::Matrix3d information(double along, double across) {
  return Eigen::Vector3d(1 / (along * along), 1 / (across * across), 1 / (0.002 * 0.002)).asDiagonal();
}

Eigen::Matrix3d covariance(double position, double yaw) {
  return Eigen::Vector3d(position * position, position * position, yaw * yaw).asDiagonal();
}

TEST(WeakDirections, WhereSurfacesDetermineThePoseTheMatchIsTaken) {
  const Estimate2 predicted{{1, 2, 0.1}, covariance(0.001, 0.001)};
  const Pose2 matched{1.05, 1.97, 0.12};
  const Estimate2 now =
      joined(predicted, covariance(0.1, 0.1).inverse(), matched, information(0.002, 0.002), 0.05);
  EXPECT_NEAR(now.T_map_base.x, matched.x, 1e-3);
  EXPECT_NEAR(now.T_map_base.y, matched.y, 1e-3);
  EXPECT_NEAR(now.T_map_base.yaw, matched.yaw, 2e-3);
  EXPECT_LT(now.covariance(0, 0), 0.003 * 0.003);
}

TEST(WeakDirections, ScansThatErrAlikeDoNotAverageToCertainty) {
  // Half a metre at 6 cm a scan; each match of the points alone is 0.2 m off along the corridor.
  Estimate2 now{{}, covariance(0.02, 0.01)};
  const Eigen::Matrix3d points = information(0.05, 0.005);
  const Pose2 step{0.06, 0, 0};
  for (int i = 0; i < 8; ++i) {
    const Pose2 expected = now.T_map_base * step;
    const Estimate2 predicted{expected, now.covariance + covariance(0.004, 0.01)};
    const Eigen::Matrix3d prior = (now.covariance + covariance(0.014, 0.05)).inverse();
    const Eigen::Vector3d alone(0.06 * (i + 1) + 0.2 - expected.x, 0, 0);
    const Eigen::Vector3d off = (prior + points).inverse() * (points * alone);
    const Pose2 matched{expected.x + off.x(), expected.y + off.y(), expected.yaw + off.z()};
    now = joined(predicted, prior, matched, points, new_fraction(step));
  }
  const double error = now.T_map_base.x - 0.48, sigma = std::sqrt(now.covariance(0, 0));
  EXPECT_LT(std::abs(error), 0.03);
  EXPECT_LT(std::abs(error), 2 * sigma);
  EXPECT_LT(std::sqrt(now.covariance(1, 1)), 0.01);
}

TEST(WeakDirections, ARobotAtRestLearnsLittleOfThem) {
  EXPECT_DOUBLE_EQ(new_fraction({2, 0, 0}), 1);
  EXPECT_NEAR(new_fraction({0.3, 0, 0.1}), 0.4, 1e-12);
  EXPECT_LT(new_fraction({}), 0.05);
  EXPECT_GT(new_fraction({}), 0);
}

Match at(const Pose2& pose, const Eigen::Matrix3d& information) {
  Match match;
  match.T_map_base = pose;
  match.information = information;
  return match;
}

/// After `length` m at 0.1 m a scan with odometry that says `scale` times that, and in turn more and less.
OdometryBelief believed(double scale, double jitter, double length, const Eigen::Matrix3d& information) {
  OdometryBelief belief(0.05);
  double x = 0;
  for (int i = 0; i * 0.1 < length; ++i) {
    const Pose2 before{x, 0, 0}, expected{x + 0.1 * scale + (i % 2 == 0 ? jitter : -jitter), 0, 0};
    x += 0.1;
    belief.add(before, expected, at({x, 0, 0}, information));
  }
  return belief;
}

TEST(OdometryBelief, DriftEndsItAndJitterWidensIt) {
  const Eigen::Matrix3d walls = information(0.003, 0.003);
  EXPECT_TRUE(OdometryBelief(0.05).is_good());
  EXPECT_TRUE(believed(1.03, 0, 10, walls).is_good());
  EXPECT_FALSE(believed(1.2, 0, 10, walls).is_good());
  EXPECT_FALSE(believed(0.8, 0, 10, walls).is_good());
  const OdometryBelief jittery = believed(1, 0.03, 10, walls), steady = believed(1, 0, 10, walls);
  EXPECT_TRUE(jittery.is_good());
  EXPECT_GT(std::sqrt(jittery.variance(0.1)), 0.02);
  EXPECT_LT(std::sqrt(steady.variance(0.1)), 0.015);
  EXPECT_LT(steady.variance(0), steady.variance(1));
}

TEST(OdometryBelief, ACorridorIsNoEvidenceOfDrift) {
  EXPECT_TRUE(believed(1.3, 0, 10, information(0.1, 0.003)).is_good());
}

}  // namespace
}  // namespace parhelion::pose
