// Roll and pitch from an inertial sensor, and encoders of a camera head, at any instant.
#include "fusion/pose/tracks/attitude_track.hpp"

#include <gtest/gtest.h>

#include "fusion/pose/tracks/joint_track.hpp"
#include "protocols/pose.hpp"

namespace parhelion::pose {
namespace {

using Eigen::AngleAxisd, Eigen::Vector3d;

Eigen::Quaterniond turned(double roll, double pitch, double yaw) {
  return AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(pitch, Vector3d::UnitY()) *
         AngleAxisd(roll, Vector3d::UnitX());
}

SensorTime at_ms(std::int64_t ms) { return SensorTime::from_utime(1'000'000'000 + ms * 1000); }

ImuSample sample(std::int64_t ms, const Eigen::Quaterniond& orientation) {
  ImuSample made;
  made.stamp = at_ms(ms);
  made.orientation = orientation;
  return made;
}

TEST(AttitudeTrack, RollAndPitchUseTheMountingForAnySensorYaw) {
  // The sensor is mounted on its side and faces backwards.
  const Eigen::Quaterniond R_base_imu = turned(1.3, -0.4, 2.9);
  AttitudeTrack track(ImuDescription{Transform<Base, Imu>(R_base_imu, {0.2, 0, 0.1})});
  for (int i = 0; i < 20; ++i) {
    const double roll = 0.02 * i - 0.2, pitch = 0.15 - 0.01 * i;
    ASSERT_TRUE(track.add(sample(20 * i, turned(roll, pitch, 1.7 * i) * R_base_imu)));
    const auto attitude = track.at(at_ms(20 * i));
    ASSERT_TRUE(attitude);
    EXPECT_NEAR(attitude->roll, roll, 1e-12);
    EXPECT_NEAR(attitude->pitch, pitch, 1e-12);
  }
  const auto between = track.at(at_ms(30));
  ASSERT_TRUE(between);
  EXPECT_NEAR(between->roll, -0.17, 1e-12);
  EXPECT_NEAR(between->pitch, 0.135, 1e-12);
}

TEST(AttitudeTrack, SamplesAreShiftedToTheClockOfTheScans) {
  AttitudeTrack track(ImuDescription{{}, -0.03});
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(track.add(sample(20 * i, turned(0.01 * i, 0, 0))));
  const auto attitude = track.at(at_ms(170));  // stamped 200 ms
  ASSERT_TRUE(attitude);
  EXPECT_NEAR(attitude->roll, 0.1, 1e-12);
}

TEST(AttitudeTrack, AnUnknownAttitudeIsNotAssumedLevel) {
  AttitudeTrack unmounted(std::nullopt);
  EXPECT_FALSE(unmounted.add(sample(0, turned(0.1, 0, 0))));
  EXPECT_FALSE(unmounted.at(at_ms(0)));

  AttitudeTrack track(ImuDescription{});
  EXPECT_FALSE(track.at(at_ms(0)));
  ImuSample blind;
  blind.stamp = at_ms(0);
  EXPECT_FALSE(track.add(blind)) << "no orientation";
  EXPECT_FALSE(track.add(sample(0, turned(0, 1.5, 0)))) << "on its nose";
  EXPECT_TRUE(track.add(sample(1000, turned(0.1, 0, 0))));
  EXPECT_FALSE(track.add(sample(900, turned(0.3, 0, 0)))) << "backward";
  EXPECT_FALSE(track.at(at_ms(999)));
  EXPECT_TRUE(track.at(at_ms(1200)));
  EXPECT_FALSE(track.at(at_ms(1201))) << "too old";
  EXPECT_TRUE(track.add(sample(1500, turned(0.2, 0, 0))));
  EXPECT_FALSE(track.at(at_ms(1250))) << "in a gap";
}

TEST(AttitudeTrack, PositionAndHeadingAreUnchanged) {
  const auto T_map_base = Transform<Map, Base>::planar(1, 2, -2.5, 0.25);
  const auto tilted = with_attitude(T_map_base, {0.1, -0.2});
  EXPECT_EQ(tilted.translation(), T_map_base.translation());
  EXPECT_NEAR(tilted.yaw(), -2.5, 1e-12);
  // Nose up by 0.2 rad: a point a metre ahead is sin 0.2 higher.
  EXPECT_NEAR((tilted * Vector3d(1, 0, 0)).z(), 0.25 + std::sin(0.2), 1e-12);
  // Left side up by 0.1 rad.
  EXPECT_NEAR((tilted * Vector3d(0, 1, 0)).z(), 0.25 + std::sin(0.1) * std::cos(0.2), 1e-12);
}

std::vector<HeadJoint> pan_tilt() {
  return {{"pan", {0.1, 0, 1.0}, Vector3d::UnitZ()}, {"tilt", {0.15, 0, 1.1}, Vector3d::UnitY()}};
}

TEST(JointTrack, TheCameraPoseFollowsTheHeadJoints) {
  JointTrack track({pan_tilt(), pan_tilt()});
  track.add({at_ms(0), {"wheel", "tilt"}, {9, 0.2}, {}, {}});
  track.add({at_ms(0), {"pan"}, {0.4}, {}, {}});
  track.add({at_ms(100), {"tilt", "pan"}, {0.4, 0.6}, {}, {}});
  const auto turn = head_turn(pan_tilt(), track, at_ms(50));
  ASSERT_TRUE(turn.ok()) << turn.error().message;
  // Reference: one frame per joint, tilt's in pan's.
  const Eigen::Isometry3d T_base_pan =
      Eigen::Translation3d(0.1, 0, 1.0) * Eigen::Isometry3d(AngleAxisd(0.5, Vector3d::UnitZ()));
  const Eigen::Isometry3d T_pan_tilt =
      Eigen::Translation3d(0.05, 0, 0.1) * Eigen::Isometry3d(AngleAxisd(0.3, Vector3d::UnitY()));
  const Vector3d p_base(0.3, 0.1, 1.2);  // a point of the camera, all joints at zero
  const Vector3d expected = T_base_pan * T_pan_tilt * (p_base - Vector3d(0.15, 0, 1.1));
  EXPECT_LT((*turn * p_base - expected).norm(), 1e-12);
}

TEST(JointTrack, SilentOrStaleEncodersAreNamed) {
  JointTrack track({pan_tilt()});
  track.add({at_ms(0), {"pan"}, {0.4}, {}, {}});
  auto turn = head_turn(pan_tilt(), track, at_ms(10));
  ASSERT_FALSE(turn.ok());
  EXPECT_NE(turn.error().message.find("'tilt'"), std::string::npos);
  track.add({at_ms(0), {"tilt"}, {0.4}, {}, {}});
  EXPECT_TRUE(head_turn(pan_tilt(), track, at_ms(10)).ok());
  track.add({at_ms(300), {"tilt"}, {0.4}, {}, {}});
  turn = head_turn(pan_tilt(), track, at_ms(310));
  ASSERT_FALSE(turn.ok());
  EXPECT_NE(turn.error().message.find("'pan'"), std::string::npos);
  track.add({at_ms(310), {"pan"}, {}, {1.0}, {}});
  EXPECT_FALSE(head_turn(pan_tilt(), track, at_ms(310)).ok()) << "a velocity is no position";
  EXPECT_TRUE(head_turn({}, track, at_ms(99'999)).ok()) << "a camera that is fixed to the base";
}

}  // namespace
}  // namespace parhelion::pose
