// The shipped lanes after the standard test methods for response robots, driven by a script.
#include "tests/server/runtime/graded_drive.hpp"

namespace parhelion::runtime {
namespace {

class Lanes : public test::GradedDrive {
 protected:
  /// Flipper angles, deg: up before an obstacle, pressed down once the robot pitches up by more than `at`.
  struct Flippers {
    double up, down, at;
  };
  bool ride(const std::vector<Eigen::Vector2d>& places, const Flippers& held, double speed) {
    for (const Eigen::Vector2d& place : places) {
      const auto ask = [&] {
        const double pitch = std::asin(motion().T_map_base.rotation()(2, 0)) / kDegree;
        send_flippers((pitch > held.at ? held.down : held.up) * kDegree);
        return towards(place, speed);
      };
      const auto there = [&] { return (motion().T_map_base.translation().head<2>() - place).norm() < 0.15; };
      if (!drive(ask, there, 40)) return false;
    }
    return true;
  }
  void flippers(double degrees) {
    move_joints({{"left_flipper_joint", degrees * kDegree}, {"right_flipper_joint", degrees * kDegree}}, 2);
  }
};

TEST_F(Lanes, TheInclinedPlaneIsDrivenUp) {
  begin("lanes/inclined_plane.yaml");
  flippers(30);
  drive_by({{2.2, 0}, {3.3, 0}}, 0.4);
  stand(4);
  EXPECT_EQ(grade().score, 100);
}

TEST_F(Lanes, TheContinuousRampsAreCrossedAtAnAngle) {
  begin("lanes/continuous_ramps.yaml");
  EXPECT_TRUE(ride({{2.3, 0.5}, {5.4, 0}}, {20, -25, 8}, 0.4));
  stand(4);
  EXPECT_EQ(grade().score, 100);
}

TEST_F(Lanes, TheHurdlesAreCrossed) {
  begin("lanes/hurdles.yaml");
  EXPECT_TRUE(ride({{5, 0}}, {15, -20, 2}, 0.4));
  stand(4);
  EXPECT_EQ(grade().score, 100);
}

TEST_F(Lanes, TheGapsAreCrossed) {
  begin("lanes/gaps.yaml");
  EXPECT_TRUE(ride({{8, 0}}, {0, 0, 90}, 0.4));
  stand(4);
  EXPECT_EQ(grade().score, 100);
}

TEST_F(Lanes, TheStairsAreClimbedToTheLanding) {
  begin("lanes/stairs_landings.yaml");
  EXPECT_TRUE(climb_to({2.9, 0}, 60));
  stand(4);
  EXPECT_EQ(grade().score, 100);
}

TEST_F(Lanes, TheCrossingRampsAreCrossed) {
  begin("lanes/crossing_ramps.yaml");
  EXPECT_TRUE(ride({{5.4, -0.55}}, {20, -25, 8}, 0.4));
  stand(4);
  EXPECT_EQ(grade().score, 100);
}

TEST_F(Lanes, RacingCrossingRampsWithFlippersUpFallsOff) {
  begin("lanes/crossing_ramps.yaml");
  const auto fell = [this] { return happened(EventKind::fell); };
  const auto race = [this] {
    send_flippers(45 * kDegree);
    return towards({5.4, -0.55}, 0.8);
  };
  EXPECT_TRUE(drive(race, fell, 60));
  ASSERT_FALSE(grade().deductions.empty());
  EXPECT_EQ(grade().deductions.back().rule, "fell");
  EXPECT_FALSE(grade().passed);
}

TEST_F(Lanes, TheStepfieldsAreCrossed) {
  begin("lanes/stepfields.yaml");
  EXPECT_TRUE(ride({{4.6, 0}}, {20, -25, 8}, 0.4));
  stand(4);
  EXPECT_EQ(grade().score, 100);
}

TEST_F(Lanes, AFigureOfEightIsDrivenRoundThePylons) {
  begin("lanes/sustained_speed.yaml");
  drive_by({{10, -2}, {12, 0}, {10, 2}, {0, 0}, {-10, -2}, {-12, 0}, {-10, 2}, {0, 0}}, 1.2);
  stand(4);
  EXPECT_EQ(grade().score, 100);
}

TEST_F(Lanes, TheTargetsInTheMazeAreFound) {
  begin("lanes/maze.yaml");
  drive_by({{0.6, 4.2}, {1.8, 4.2}, {1.8, 2.7}}, 0.6);
  wait(1.5);
  EXPECT_EQ(grade().score, 30);
  drive_by({{1.8, 4.2}, {0.6, 4.2}, {0.6, 5.4}, {4.2, 5.4}, {4.2, 4.2}, {5.4, 4.1}}, 0.6);
  look_at({5.4, 5.4});
  wait(1.5);
  EXPECT_EQ(grade().score, 60);
  drive_by({{3, 4.2}, {3, 1.8}, {5.4, 1.8}, {5.45, 3}}, 0.6);
  look_at({4, 3});
  stand(2);
  EXPECT_EQ(grade().score, 100);
}

TEST_F(Lanes, TheRadioReachesBehindBothBarriers) {
  begin("lanes/radio.yaml");
  drive_by({{7, -4}, {7, 4.5}, {12.2, 4.5}, {12.2, 3}}, 1);
  look_at({13.2, 0});
  wait(1.5);
  EXPECT_EQ(grade().score, 40);
  drive_by({{12, -4.5}, {18, -4.5}, {20, 0}}, 1);
  look_at({21, 4});
  stand(2);
  EXPECT_EQ(grade().score, 100);
}

}  // namespace
}  // namespace parhelion::runtime
