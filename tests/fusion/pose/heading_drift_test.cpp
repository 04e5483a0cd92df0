#include "fusion/pose/mapping/heading_drift.hpp"

#include <gtest/gtest.h>

#include <random>

#include "fusion/pose/slam.hpp"
#include "tests/fusion/pose/corridors.hpp"
#include "tests/fusion/pose/corrupted_odometry.hpp"

namespace parhelion::pose {
namespace {

constexpr double kOneDegree = std::numbers::pi / 180;
constexpr double kStep = 0.2;  // m, between keyframes

/// A drive with two turns through a building whose walls are at right angles but for errors of `walls`, rad
/// (1 sigma). The heading of the map drifts by `rate` rad/m, and up to `expected` rad/sqrt(m) are expected of
/// it.
struct DriftingDrive {
  std::vector<Keyframe> keyframes;
  std::vector<double> true_yaw;
  std::size_t corrections = 0;

  DriftingDrive(double rate, double expected, double walls, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> off(0, walls), noise(0, 0.1 * kOneDegree);
    HeadingDrift heading;
    std::vector<double> seen(4);
    for (int i = 0; i < 500; ++i) {
      if (i % 25 == 0)  // each 5 m other walls
        for (std::size_t w = 0; w < 4; ++w)
          seen[w] = static_cast<double>(w % 2) * std::numbers::pi / 2 + off(random);
      const double yaw = (i / 150) * std::numbers::pi / 2;
      Keyframe keyframe;
      keyframe.driven = kStep * i;
      keyframe.drift(2, 2) = expected * expected * keyframe.driven;
      if (i > 0) {
        keyframe.step = {kStep, 0, wrap_angle(yaw - true_yaw.back()) + rate * kStep};
        keyframe.T_map_base = keyframes.back().T_map_base * keyframe.step;
      }
      for (const double wall : seen) keyframe.walls.push_back({wall - yaw + noise(random), 3});
      keyframes.push_back(keyframe);
      true_yaw.push_back(yaw);
      if (const auto correction = heading.check(keyframes)) {
        bend(keyframes, *correction);
        ++corrections;
      }
      heading.learn(keyframes);
    }
  }

  double largest_error() const {
    double largest = 0;
    for (std::size_t k = 0; k < keyframes.size(); ++k)
      largest = std::max(largest, std::abs(wrap_angle(keyframes[k].T_map_base.yaw - true_yaw[k])));
    return largest;
  }
};

TEST(HeadingDrift, IsTakenOutOfAPathAmongWallsAtRightAngles) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    for (const double rate : {-0.04, 0.04}) {
      const DriftingDrive drive(rate * kOneDegree, 0.07 * kOneDegree, 0.3 * kOneDegree, seed);
      EXPECT_GT(drive.corrections, 15U);
      // 4 degrees without correction.
      EXPECT_LT(drive.largest_error(), 1.2 * kOneDegree) << seed << ", " << rate;
    }
  }
}

TEST(HeadingDrift, APathWithoutDriftIsHardlyBentByWallsThatAreNotParallel) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const DriftingDrive drive(0, 0.03 * kOneDegree, 1.5 * kOneDegree, seed);
    EXPECT_LT(drive.largest_error(), 1.0 * kOneDegree) << seed;
  }
}

/// Around a ring of corridors, with ranges that are up to 2 cm off, by the beam's angle.
test::TrueDrive biased_drive(std::uint32_t seed) {
  constexpr double kBias = 0.02;  // m
  test::CorridorOptions corridors;
  corridors.xs = {0, 40}, corridors.ys = {0, 25};
  corridors.clutter = 0;
  corridors.seed = seed;
  test::TrueBuilding building = test::corridor_building(corridors);
  building.route = {{2, 0}, {40, 0}, {40, 25}, {0, 25}, {0, 5}};
  RobotDescription robot = test::robot_with_laser();
  LaserDescription& laser = *robot.laser;
  laser.beams = 360;
  laser.angle_min = -std::numbers::pi;
  laser.angle_increment = std::numbers::pi / 180;
  laser.beam_interval = 0;
  laser.convention.range_max = 6;
  test::TrueDrive drive =
      test::true_drive(building, robot, {.seed = seed, .scan_period = 0.2, .odometry_late = 0});
  for (test::TrueScan& scan : drive.scans) {
    for (std::size_t i = 0; i < scan.scan.ranges.size(); ++i) {
      float& range = scan.scan.ranges[i];
      if (laser.convention.classify(range) == BeamKind::hit)
        range += static_cast<float>(kBias * std::sin(static_cast<double>(i) * std::numbers::pi / 180));
    }
  }
  return drive;
}

TEST(HeadingDrift, IsSmallerInTheMapOfALaserThatIsOff) {
  for (const std::uint32_t seed : {11U, 12U}) {
    const test::TrueDrive drive = biased_drive(seed);
    const auto slam = make_mapper(drive.robot, {});
    ASSERT_TRUE(slam.ok());
    double off = 0;
    std::optional<double> first;
    for (const test::DriveInput& input : test::inputs_of(drive)) {
      if (!input.scan) (*slam)->add(input.odometry);
      const auto estimate = input.scan ? (*slam)->add(*input.scan) : std::nullopt;
      if (!estimate) continue;
      const double yaw = wrap_angle(planar(estimate->T_map_base).yaw - drive.at(estimate->stamp).yaw);
      if (!first) first = yaw;
      off = std::max(off, std::abs(wrap_angle(yaw - *first)));
    }
    std::printf("seed %u: the heading is up to %.2f degrees off\n", seed, off / kOneDegree);
    EXPECT_LT(off, 7 * kOneDegree) << "9.3 degrees without the directions of walls";
  }
}

TEST(HeadingDrift, ABentPathHasTheStepsOfItsPoses) {
  DriftingDrive drive(0, 0, 0.1 * kOneDegree, 1);
  const std::vector<Keyframe> before = drive.keyframes;
  bend(drive.keyframes, {480, 0.1});
  for (std::size_t k = 1; k < before.size(); ++k) {
    const Pose2 step = drive.keyframes[k - 1].T_map_base.inverse() * drive.keyframes[k].T_map_base;
    EXPECT_NEAR(step.x, drive.keyframes[k].step.x, 1e-9);
    EXPECT_NEAR(wrap_angle(step.yaw - drive.keyframes[k].step.yaw), 0, 1e-9);
    if (k < 480) {
      EXPECT_EQ(drive.keyframes[k].T_map_base.yaw, before[k].T_map_base.yaw);
    }
  }
  EXPECT_NEAR(wrap_angle(drive.keyframes.back().T_map_base.yaw - before.back().T_map_base.yaw), 0.1, 1e-9);
}

TEST(HeadingDrift, ATurnThatIsFarLargerThanTheExpectedDriftIsAnotherDirectionOfWalls) {
  HeadingDrift heading;
  std::vector<Keyframe> keyframes;
  for (int i = 0; i < 200; ++i) {
    Keyframe keyframe;
    keyframe.driven = kStep * i;
    keyframe.drift(2, 2) = 1e-8 * keyframe.driven;
    const double direction = i < 100 ? 0 : 2.5 * kOneDegree;
    keyframe.walls = {{direction, 4}, {direction, 4}};
    keyframes.push_back(keyframe);
    const auto correction = heading.check(keyframes);
    EXPECT_FALSE(correction && std::abs(correction->turn) > 0.1 * kOneDegree) << i;
    if (correction) bend(keyframes, *correction);
    heading.learn(keyframes);
  }
}

}  // namespace
}  // namespace parhelion::pose
