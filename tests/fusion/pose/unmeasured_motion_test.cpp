// Odometry that stops harder than robots brake, and the way that the robot may have driven since.
#include "fusion/pose/mapping/unmeasured_motion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <numbers>

#include "fusion/pose/odometry/abrupt_stop.hpp"
#include "fusion/pose/slam.hpp"
#include "tests/fusion/pose/corrupted_odometry.hpp"
#include "tests/fusion/pose/estimate_error.hpp"

namespace parhelion::pose {
namespace {

constexpr double kPeriod = 0.05;  // s
constexpr double kHeading = 0.3;  // rad

/// A robot whose speed (m/s) is a function of the time (s).
class Wheels {
 public:
  template <class Receiver>
  void drive(Receiver& receiver, double seconds, const std::function<double(double)>& speed) {
    for (double t = kPeriod; t < seconds + 1e-9; t += kPeriod) {
      now_ += kPeriod;
      T_odom_base_ = T_odom_base_ * Pose2{kPeriod * std::max(0.0, speed(t - kPeriod / 2)), 0, 0};
      receiver.add({stamp(), transform<Odom, Base>(T_odom_base_)});
    }
  }
  void wait(double seconds) { now_ += seconds; }
  SensorTime stamp() const { return SensorTime{} + seconds(now_); }

 private:
  double now_ = 100;
  Pose2 T_odom_base_{0, 0, kHeading};
};

const auto kStands = [](double) { return 0.0; };
auto driving_at(double speed) {
  return [speed](double) { return speed; };
}
auto braking(double speed, double deceleration) {
  return [speed, deceleration](double t) { return speed - deceleration * t; };
}
auto setting_off(double speed, double acceleration) {
  return [speed, acceleration](double t) { return std::min(speed, acceleration * t); };
}

TEST(AbruptStop, IsOneThatNoRobotBrakesFor) {
  for (const double speed : {0.5, 0.6, 1.0, 1.5, 3.0}) {
    Wheels wheels;
    AbruptStop stop;
    wheels.drive(stop, 3, driving_at(speed));
    EXPECT_FALSE(stop.is_stopped());
    wheels.drive(stop, 20, kStands);
    EXPECT_TRUE(stop.is_stopped()) << speed;
    EXPECT_NEAR(stop.speed(), speed, 0.05 * speed);
    wheels.drive(stop, 1, driving_at(speed));
    EXPECT_FALSE(stop.is_stopped());
    EXPECT_FALSE(stop.was_true()) << "it goes on at full speed";
  }
}

TEST(AbruptStop, ARobotThatBrakesIsNot) {
  for (const double deceleration : {0.5, 1.0, 2.0, 2.5}) {
    for (const double speed : {0.2, 0.6, 1.5, 3.0}) {
      Wheels wheels;
      AbruptStop stop;
      wheels.drive(stop, 3, driving_at(speed));
      wheels.drive(stop, speed / deceleration + 1, braking(speed, deceleration));
      EXPECT_FALSE(stop.is_stopped()) << speed << " m/s, " << deceleration << " m/s^2";
    }
  }
}

TEST(AbruptStop, AnEmergencyStopIsKnownWhenTheRobotSetsOffAgain) {
  Wheels wheels;
  AbruptStop stop;
  wheels.drive(stop, 3, driving_at(1));
  wheels.drive(stop, 5, kStands);
  EXPECT_TRUE(stop.is_stopped());
  wheels.drive(stop, 1, setting_off(1, 1));
  EXPECT_FALSE(stop.is_stopped());
  EXPECT_TRUE(stop.was_true());
}

TEST(AbruptStop, IsNotKnownToBeTheRobotsAfterAGap) {
  Wheels wheels;
  AbruptStop stop;
  wheels.drive(stop, 3, driving_at(1));
  wheels.drive(stop, 3, kStands);
  EXPECT_TRUE(stop.is_stopped());
  wheels.wait(5);
  wheels.drive(stop, 1, driving_at(1));
  EXPECT_FALSE(stop.is_stopped());
  EXPECT_FALSE(stop.was_true());
}

TEST(AbruptStop, IsNoticedInFastOdometry) {
  AbruptStop stop;
  for (int i = 0; i < 1000; ++i) {
    const Pose2 pose{0.002 * std::min(i, 700), 0, 0};  // 500 Hz, 1 m/s
    stop.add({SensorTime{} + seconds(0.002 * i), transform<Odom, Base>(pose)});
    EXPECT_EQ(stop.is_stopped(), i > 700);
  }
  EXPECT_TRUE(stop.is_stopped());
}

TEST(AbruptStop, NothingFollowsFromOdometryThatArrivesSeldom) {
  AbruptStop stop;
  for (int i = 0; i < 40; ++i) {
    const Pose2 pose{0.25 * std::min(i, 20), 0, 0};
    stop.add({SensorTime{} + seconds(0.25 * i), transform<Odom, Base>(pose)});
    EXPECT_FALSE(stop.is_stopped());
  }
}

/// Of scans that show position and heading, or all but the position along the heading.
Eigen::Matrix3d shown(bool everywhere) {
  const Eigen::Vector2d ahead(std::cos(kHeading), std::sin(kHeading)), left(-ahead.y(), ahead.x());
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  information.topLeftCorner<2, 2>() =
      1e5 * left * left.transpose() + (everywhere ? 1e5 : 10) * ahead * ahead.transpose();
  information(2, 2) = 1e5;
  return information;
}

/// Scans ten times a second while odometry goes on as `speed`.
Eigen::Vector2d scanned(UnmeasuredMotion& motion, Wheels& wheels, double seconds, bool everywhere,
                        const std::function<double(double)>& speed, bool by_odometry = true,
                        double heading = kHeading, Eigen::Vector2d sum = Eigen::Vector2d::Zero()) {
  const Eigen::Vector2d before = sum;
  for (double t = 0; t < seconds - 1e-9; t += 2 * kPeriod) {
    wheels.drive(motion, 2 * kPeriod, [&](double dt) { return speed(t + dt); });
    sum += motion.add(wheels.stamp(), {0, 0, heading}, shown(everywhere), by_odometry, 0.6, sum);
  }
  return sum - before;
}

TEST(UnmeasuredMotion, GrowsAlongACorridorWhileOdometryMayBeFrozen) {
  Wheels wheels;
  UnmeasuredMotion motion;
  EXPECT_TRUE(scanned(motion, wheels, 5, false, driving_at(0.6)).isZero());
  const Eigen::Vector2d driven = scanned(motion, wheels, 10, false, kStands);
  EXPECT_NEAR(driven.norm(), 6, 0.5);
  EXPECT_NEAR(std::atan2(driven.y(), driven.x()), kHeading, 1e-6);
  EXPECT_TRUE(motion.is_unmeasured());
  EXPECT_TRUE(scanned(motion, wheels, 1, true, kStands).isZero());
  EXPECT_FALSE(motion.is_unmeasured()) << "the scans show it";
}

TEST(UnmeasuredMotion, IsNoneWhereScansShowThePositionOrTheRobotHasBraked) {
  Wheels in_a_room, in_a_corridor;
  UnmeasuredMotion shown_by_scans, braked;
  scanned(shown_by_scans, in_a_room, 5, true, driving_at(0.6));
  EXPECT_TRUE(scanned(shown_by_scans, in_a_room, 60, true, kStands).isZero());
  EXPECT_FALSE(shown_by_scans.is_unmeasured());
  scanned(braked, in_a_corridor, 5, false, driving_at(0.6));
  EXPECT_TRUE(scanned(braked, in_a_corridor, 60, false, braking(0.6, 1)).isZero());
  EXPECT_FALSE(braked.is_unmeasured());
}

TEST(UnmeasuredMotion, IsTakenBackWhereItWasTheRobotThatStopped) {
  Wheels wheels;
  UnmeasuredMotion motion;
  scanned(motion, wheels, 5, false, driving_at(1));
  Eigen::Vector2d driven = scanned(motion, wheels, 10, false, kStands);
  EXPECT_GT(driven.norm(), 9);
  driven += scanned(motion, wheels, 3, false, setting_off(1, 0.8));
  EXPECT_LT(driven.norm(), 1e-9);
  EXPECT_FALSE(motion.is_unmeasured());
}

TEST(UnmeasuredMotion, OfTwoStretchesDoesNotCancel) {
  Wheels wheels;
  UnmeasuredMotion motion;
  scanned(motion, wheels, 5, false, driving_at(0.6));
  const Eigen::Vector2d there = scanned(motion, wheels, 5, false, driving_at(0.1), false);
  const Eigen::Vector2d back =
      scanned(motion, wheels, 5, false, driving_at(0.1), false, kHeading + std::numbers::pi, there);
  EXPECT_NEAR((there + back).norm(), 6, 0.2);
}

TEST(UnmeasuredMotion, AFaultAfterAStopIsNotTakenBackWithIt) {
  Wheels wheels;
  UnmeasuredMotion motion;
  scanned(motion, wheels, 5, false, driving_at(1));
  Eigen::Vector2d sum = scanned(motion, wheels, 5, false, kStands);
  sum += scanned(motion, wheels, 3, false, setting_off(1, 0.8), true, kHeading, sum);
  EXPECT_LT(sum.norm(), 1e-9) << "the robot had stopped";
  sum += scanned(motion, wheels, 5, false, driving_at(0.3), false, kHeading, sum);
  const double of_fault = sum.norm();
  EXPECT_GT(of_fault, 2);
  sum += scanned(motion, wheels, 3, false, driving_at(0.6), true, kHeading, sum);
  EXPECT_NEAR(sum.norm(), of_fault, 1e-9);
}

TEST(UnmeasuredMotion, GrowsWithTheSpeedOfScansWhereOdometryHasAFault) {
  Wheels wheels;
  UnmeasuredMotion motion;
  scanned(motion, wheels, 2, false, driving_at(0.6));
  EXPECT_NEAR(scanned(motion, wheels, 10, false, driving_at(0.1), false).norm(), 6, 0.1);
  EXPECT_TRUE(motion.is_unmeasured());
}

TEST(UnmeasuredMotion, AMapOfABareCorridorIsUnsureAndHoldsTheErrorAfterOdometryFroze) {
  RobotDescription robot = test::robot_with_laser();
  robot.laser->convention.range_max = 8;
  test::TrueBuilding building;
  test::add_box(building.mapped, 0, -1.1, 45, 1.1);
  building.now = building.mapped;
  building.route = {{3, 0}, {41, 0.1}};
  test::TrueDriveOptions options;
  options.odometry_late = 0.02;
  options.odometry_jitter = 0.01;
  options.odometry_scale = 1.01;
  const test::TrueDrive drive = test::true_drive(building, robot, options);
  const SensorTime frozen_at = drive.scans[drive.scans.size() * 2 / 5].scan.stamp;
  auto slam = make_mapper(drive.robot, {});
  std::optional<Pose2> T_true_map, frozen;
  std::size_t scans = 0, tracking = 0, held = 0;
  for (test::DriveInput& input : test::inputs_of(drive)) {
    if (!input.scan) {
      if (input.odometry.stamp > frozen_at) {
        if (!frozen) frozen = planar(input.odometry.T_odom_base);
        input.odometry.T_odom_base = transform<Odom, Base>(*frozen);
      }
      (*slam)->add(input.odometry);
    } else if (const auto estimate = (*slam)->add(*input.scan)) {
      const Pose2 found = planar(estimate->T_map_base), truth = drive.at(estimate->stamp);
      if (!T_true_map) T_true_map = truth * found.inverse();
      if (estimate->stamp < frozen_at + seconds(2.0)) {
        EXPECT_TRUE(estimate->stamp > frozen_at || estimate->state == SlamState::tracking);
        continue;
      }
      ++scans;
      tracking += estimate->state == SlamState::tracking ? 1 : 0;
      const auto error = test::planar_error(found, T_true_map->inverse() * truth);
      held += test::holds_position(test::planar_covariance(*estimate), error) ? 1 : 0;
    }
  }
  std::printf("%zu of %zu tracking, %zu in the ellipse\n", tracking, scans, held);
  EXPECT_GT(scans, 200U);
  EXPECT_LT(tracking, scans / 10);
  EXPECT_GT(held, scans * 9 / 10);
}

}  // namespace
}  // namespace parhelion::pose
