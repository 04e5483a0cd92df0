// What a map's own errors leave of a match, on maps whose scans were placed with known errors.
#include "fusion/pose/matching/map_accuracy.hpp"

#include <gtest/gtest.h>

#include "fusion/pose/matching/scan_match.hpp"
#include "fusion/pose/matching/scan_points.hpp"
#include "tests/allocations.hpp"
#include "tests/fusion/pose/true_drive.hpp"

namespace parhelion::pose {
namespace {

constexpr std::size_t kPoints = 240;

/// Of poses that are wrong by `sigma` m and, at 5 m, as much by their headings; for some ten scans each.
SurfelMap mapped(const test::TrueBuilding& building, const RobotDescription& robot, double sigma) {
  RobotDescription frozen = robot;
  frozen.laser->beam_interval = 0;
  std::mt19937 random(7);
  std::normal_distribution<double> noise;
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  SurfelMap map(0.1);
  for (const MappedScan& scan : test::true_map(building, robot)) {
    for (double& each : error) each = 0.9 * each + std::sqrt(1 - 0.81) * noise(random);
    const Pose2 off{sigma * error.x(), sigma * error.y(), sigma / 5 * error.z()};
    map.add(deskewed(scan.scan, *frozen.laser, {}).points, scan.T_map_base * off);
  }
  map.finish();
  return map;
}

struct SigmaPair {
  double estimated = 0, true_one = 0;  ///< m, 1 sigma along one axis
};

/// The true one: from matches of scans without noise.
SigmaPair accuracy_of(double map_sigma, double range_sigma, int people) {
  const test::TrueBuilding building = test::office(2);
  const RobotDescription robot = test::robot_with_laser();
  const SurfelMap map = mapped(building, robot, map_sigma);
  test::TrueDriveOptions options;
  options.range_sigma = range_sigma;
  options.people = people;
  const test::TrueDrive drive = test::true_drive(building, robot, options);
  MapAccuracy accuracy(kPoints);
  double squares = 0;
  for (const test::TrueScan& at : drive.scans) {
    const auto points = thinned(deskewed(at.scan, *robot.laser, at.twist).points, kPoints);
    const Match found = match(map, points, at.T_map_base, at.T_map_base, Eigen::Matrix3d::Zero(), {});
    accuracy.add(map, points, found.T_map_base);
    squares += (found.T_map_base.position() - at.T_map_base.position()).squaredNorm() / 2;
  }
  return {accuracy.position_sigma(), std::sqrt(squares / static_cast<double>(drive.scans.size()))};
}

TEST(MapAccuracy, SeesNoErrorsWhereThereAreNone) {
  EXPECT_LT(accuracy_of(0, 0.01, 0).estimated, 0.0007);
  EXPECT_LT(accuracy_of(0, 0.01, 6).estimated, 0.0007);
}

TEST(MapAccuracy, SeesHowFarTheMapsScansAreApart) {
  for (const double sigma : {0.005, 0.01}) {
    const SigmaPair accuracy = accuracy_of(sigma, 0.01, 3);
    EXPECT_GT(accuracy.estimated, 0.6 * accuracy.true_one);
    EXPECT_LT(accuracy.estimated, 1.6 * accuracy.true_one);
  }
}

TEST(MapAccuracy, DoubtsTheMapUntilScansHaveBeenSeen) {
  const MapAccuracy accuracy(kPoints);
  EXPECT_NEAR(accuracy.position_sigma(), 0.005, 1e-6);
  EXPECT_NEAR(accuracy.yaw_sigma(), 0.0017, 1e-4);
}

TEST(MapAccuracy, AllocatesNothing) {
  const RobotDescription robot = test::robot_with_laser();
  const test::TrueBuilding building = test::office(2);
  const SurfelMap map = mapped(building, robot, 0);
  const test::TrueScan at = test::true_drive(building, robot, {}).scans.front();
  const auto points = thinned(deskewed(at.scan, *robot.laser, at.twist).points, kPoints);
  MapAccuracy accuracy(kPoints);
  const double before = accuracy.position_sigma();
  const test::AllocationWatch watch;
  accuracy.add(map, points, at.T_map_base);
  EXPECT_EQ(watch.count(), 0U);
  EXPECT_NE(accuracy.position_sigma(), before);
}

}  // namespace
}  // namespace parhelion::pose
