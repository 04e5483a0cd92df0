// The factor between formal and true covariance of a match, against errors that are known.
#include "fusion/pose/matching/match_consistency.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "fusion/pose/matching/scan_points.hpp"
#include "tests/allocations.hpp"
#include "tests/fusion/pose/true_drive.hpp"

namespace parhelion::pose {
namespace {

constexpr std::size_t kScanPoints = 240;

SurfelMap mapped_walls(const test::TrueBuilding& building, const RobotDescription& robot) {
  RobotDescription frozen = robot;
  frozen.laser->beam_interval = 0;
  SurfelMap map(0.1);
  for (const MappedScan& scan : test::true_map(building, robot))
    map.add(deskewed(scan.scan, *frozen.laser, {}).points, scan.T_map_base);
  map.finish();
  return map;
}

/// Mean normalised square of the errors of matches, per direction, as the formal covariance takes them; and
/// what MatchConsistency made of the same matches.
struct Factors {
  double true_one = 0, estimated = 0;
};

/// `shared`: neighbouring beams that have the same error of 1 cm.
Factors factors_of(const test::TrueBuilding& building, test::TrueDriveOptions options, std::size_t shared) {
  const RobotDescription robot = test::robot_with_laser();
  const SurfelMap map = mapped_walls(building, robot);
  if (shared > 1) options.range_sigma = 0;
  const test::TrueDrive drive = test::true_drive(building, robot, options);
  MatchConsistency consistency(kScanPoints);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.01);
  double squares = 0;
  for (const test::TrueScan& at : drive.scans) {
    Scan scan = at.scan;
    float error = 0;
    for (std::size_t i = 0; shared > 1 && i < scan.ranges.size(); ++i) {
      if (i % shared == 0) error = static_cast<float>(noise(random));
      scan.ranges[i] += error;
    }
    const auto points = thinned(deskewed(scan, *robot.laser, at.twist).points, kScanPoints);
    const Match found =
        match(map, points, at.T_map_base, at.T_map_base, Eigen::Matrix3d::Zero(), MatchOptions());
    consistency.add(map, points, found.T_map_base, {});
    const Pose2& truth = at.T_map_base;
    const Eigen::Vector3d off(found.T_map_base.x - truth.x, found.T_map_base.y - truth.y,
                              wrap_angle(found.T_map_base.yaw - truth.yaw));
    squares += off.dot(found.information * off) / 3;
  }
  return {squares / static_cast<double>(drive.scans.size()), consistency.factor()};
}

void expect_true(const Factors& factors) {
  EXPECT_GT(factors.estimated, 0.65 * factors.true_one);
  EXPECT_LT(factors.estimated, 1.6 * factors.true_one);
}

TEST(MatchConsistency, FindsTheFactorOfIndependentBeams) {
  const Factors factors = factors_of(test::office(2), {}, 1);
  EXPECT_LT(factors.true_one, 0.1) << "the formal covariance takes neighbours as dependent";
  expect_true(factors);
}

TEST(MatchConsistency, FindsItAmongPeopleInAChangedBuilding) {
  test::TrueDriveOptions options;
  options.people = 4;
  expect_true(factors_of(test::office(1, 0.2), options, 1));
}

TEST(MatchConsistency, FindsTheLargerFactorOfBeamsWithCommonErrors) {
  const Factors alone = factors_of(test::office(4), {}, 1), shared = factors_of(test::office(4), {}, 12);
  EXPECT_GT(shared.true_one, 3 * alone.true_one);
  expect_true(shared);
}

TEST(MatchConsistency, GainsNoCertaintyAlongACorridor) {
  const test::TrueBuilding corridor = test::long_corridor();
  const RobotDescription robot = test::robot_with_laser();
  const SurfelMap map = mapped_walls(corridor, robot);
  const test::TrueDrive drive = test::true_drive(corridor, robot, {});
  MatchConsistency consistency(kScanPoints);
  Match found;
  for (const test::TrueScan& at : drive.scans) {
    const auto points = thinned(deskewed(at.scan, *robot.laser, at.twist).points, kScanPoints);
    found = match(map, points, at.T_map_base, at.T_map_base, Eigen::Matrix3d::Zero(), {});
    consistency.add(map, points, found.T_map_base, {});
  }
  const auto variances = [](const Eigen::Matrix3d& information) {
    return Eigen::Vector3d(information.inverse().diagonal());
  };
  const Eigen::Vector3d formal = variances(found.information);
  const Eigen::Vector3d corrected = variances(consistency.information(found.information));
  EXPECT_GT(formal.x(), 0.04 * 0.04);
  EXPECT_GT(corrected.x(), 0.5 * formal.x());
  EXPECT_LT(corrected.y(), 0.1 * formal.y()) << "across it";
  EXPECT_LT(corrected.z(), 0.1 * formal.z());
}

TEST(MatchConsistency, DividesTheInformationByTheFactor) {
  MatchConsistency consistency(kScanPoints);
  const Eigen::Matrix3d formal =
      (Eigen::Matrix3d() << 4e4, 5e3, 1e4, 5e3, 3e4, -2e3, 1e4, -2e3, 9e5).finished();
  EXPECT_TRUE(consistency.information(formal).isApprox(formal, 1e-9)) << "before the first scan";
  const test::TrueBuilding building = test::office(2);
  const RobotDescription robot = test::robot_with_laser();
  const SurfelMap map = mapped_walls(building, robot);
  for (const test::TrueScan& at : test::true_drive(building, robot, {}).scans)
    consistency.add(map, thinned(deskewed(at.scan, *robot.laser, at.twist).points, kScanPoints),
                    at.T_map_base, {});
  EXPECT_TRUE(consistency.information(formal).isApprox(formal / consistency.factor(), 0.05));
  EXPECT_NE(consistency.factor(), 1);
  consistency.forget();
  EXPECT_EQ(consistency.factor(), 1);
}

TEST(MatchConsistency, AllocatesNothing) {
  const test::TrueBuilding building = test::office(2);
  const RobotDescription robot = test::robot_with_laser();
  const SurfelMap map = mapped_walls(building, robot);
  const test::TrueScan at = test::true_drive(building, robot, {}).scans.front();
  const auto points = thinned(deskewed(at.scan, *robot.laser, at.twist).points, kScanPoints);
  MatchConsistency consistency(kScanPoints);
  const test::AllocationWatch watch;
  consistency.add(map, points, at.T_map_base, {});
  EXPECT_NE(consistency.information(1e5 * Eigen::Matrix3d::Identity())(0, 0), 0);
  EXPECT_EQ(watch.count(), 0U);
}

}  // namespace
}  // namespace parhelion::pose
