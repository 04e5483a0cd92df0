#include "fusion/pose/odometry/scan_motion.hpp"

#include <gtest/gtest.h>

#include <random>

namespace parhelion::pose {
namespace {

SensorTime instant(double s) { return SensorTime{1'000'000'000'000'000} + seconds(s); }
const Twist2 kTwist{0.5, 0, 0.3};

/// A circle at constant speed; odometry's predictions are `sigma` m off.
ScanMotion driven(double sigma, int scans) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise;
  ScanMotion motion;
  for (int i = 0; i < scans; ++i) {
    const Pose2 truth = moved(kTwist, 0.1 * i);
    const Pose2 seen = truth * Pose2{0.003 * noise(random), 0.003 * noise(random), 0};
    motion.add(instant(0.1 * i), seen, truth * Pose2{sigma * noise(random), 0, sigma / 5 * noise(random)});
  }
  return motion;
}

TEST(ScanMotion, IsPreferredOnlyWhereOdometryIsClearlyWorse) {
  EXPECT_FALSE(driven(0.001, 100).is_preferred());
  EXPECT_FALSE(driven(0.1, 5).is_preferred()) << "too few scans to tell";
  EXPECT_TRUE(driven(0.1, 100).is_preferred());
}

TEST(ScanMotion, PredictsWithAnErrorThatItStates) {
  const ScanMotion motion = driven(0.1, 100);
  for (const double ahead : {-0.1, 0.05, 0.2, 0.4}) {
    const auto predicted = motion.at(instant(9.9 + ahead));
    ASSERT_TRUE(predicted);
    const Pose2 from = motion.last_step()->T_map_base * predicted->step;
    const double error = (from.position() - moved(kTwist, 9.9 + ahead).position()).norm();
    EXPECT_LT(error, 3 * std::sqrt(2 * predicted->position_variance) + 0.01) << ahead;
  }
  EXPECT_FALSE(motion.at(instant(9.9 + 0.6))) << "too far ahead";
}

TEST(ScanMotion, KeepsItsTwistWhereThePoseIsCorrected) {
  ScanMotion motion = driven(0.1, 100);
  const auto before = motion.last_step();
  ASSERT_TRUE(before);
  EXPECT_NEAR(before->seconds, 0.1, 1e-9);
  EXPECT_NEAR(before->twist.vx, kTwist.vx, 0.2);
  motion.correct({1, 2, 0.5});
  EXPECT_NEAR(motion.last_step()->T_map_base.yaw, wrap_angle(before->T_map_base.yaw + 0.5), 1e-9);
  EXPECT_EQ(motion.last_step()->twist.vx, before->twist.vx);
}

TEST(ScanMotion, KnowsNoMotionAfterAGap) {
  ScanMotion motion = driven(0.1, 100);
  motion.add(instant(20), {}, std::nullopt);
  EXPECT_FALSE(motion.at(instant(20.1)));
}

}  // namespace
}  // namespace parhelion::pose
