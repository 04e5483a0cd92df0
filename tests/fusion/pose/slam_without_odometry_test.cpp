// Robots that report no odometry, or one whose stamps are of another clock: scans show how they move.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "fusion/pose/mapping/odometry_by_scans.hpp"
#include "fusion/pose/slam.hpp"
#include "tests/fusion/pose/swept_drive.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::pose {
namespace {

constexpr double kBeamInterval = 0.05 / 361;  // s

test::SweptDrive drive(std::uint32_t seed) {
  return test::swept_drive(seed, kBeamInterval, kBeamInterval, 0, 1);
}

/// The largest distance from the truth, m; the map's origin is where the robot was at the first scan.
double largest_error(const std::vector<Pose2>& found, const test::SweptDrive& drive) {
  double largest = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Pose2 truth = drive.truth[0].inverse() * drive.truth[i];
    largest = std::max(largest, (found[i].position() - truth.position()).norm());
  }
  return largest;
}

struct Followed {
  std::vector<Pose2> slam, odometry;  ///< at each scan
  std::size_t tracking = 0;
};

/// Odometry is given as it is in the drive, later by `late`, or not at all.
Followed follow(Slam& slam, const test::SweptDrive& drive, std::optional<Duration> late = std::nullopt) {
  Followed result;
  for (const test::DriveInput& input : drive.inputs) {
    if (!input.scan) {
      Odometry odometry = input.odometry;
      if (late) odometry.stamp = odometry.stamp + *late;
      if (late) slam.add(odometry);
      continue;
    }
    const auto estimate = slam.add(*input.scan);
    if (!estimate) continue;
    result.slam.push_back(planar(estimate->T_map_base));
    result.tracking += estimate->state == SlamState::tracking ? 1 : 0;
    if (const auto odometry = slam.odometry_by_scans())
      result.odometry.push_back(planar(odometry->T_odom_base));
  }
  return result;
}

SlamOptions without_odometry(SlamEngine engine = SlamEngine::parhelion) {
  SlamOptions options;
  options.engine = engine;
  options.has_odometry = false;
  return options;
}

class SlamWithoutOdometry : public ::testing::TestWithParam<std::uint32_t> {};

TEST_P(SlamWithoutOdometry, MapsByScansAlone) {
  const test::SweptDrive drive = pose::drive(GetParam());
  auto slam = make_mapper(drive.robot, without_odometry());
  ASSERT_TRUE(slam.ok()) << slam.error().message;
  const Followed found = follow(**slam, drive);
  EXPECT_EQ(found.tracking, drive.truth.size());
  ASSERT_EQ(found.odometry.size(), drive.truth.size());
  EXPECT_LT(largest_error(found.slam, drive), 0.05);
  EXPECT_LT(largest_error(found.odometry, drive), 0.05);
  EXPECT_TRUE((*slam)->odometry_findings().empty()) << (*slam)->odometry_findings().front().text;
}

TEST_P(SlamWithoutOdometry, LocalizesInAMapByScansAlone) {
  const test::TemporaryFolder folder;
  const test::SweptDrive mapped = pose::drive(GetParam());
  auto mapper = make_mapper(mapped.robot, {});
  ASSERT_TRUE(mapper.ok()) << mapper.error().message;
  follow(**mapper, mapped, Duration{});
  (*mapper)->finish();
  const std::string map = folder / "map.simplemap";
  ASSERT_TRUE((*mapper)->save_simplemap(map).ok());

  SlamOptions options = without_odometry();
  options.start = Eigen::Vector3d::Zero();
  auto slam = make_localizer(mapped.robot, map, options);
  ASSERT_TRUE(slam.ok()) << slam.error().message;
  const Followed found = follow(**slam, mapped);
  EXPECT_EQ(found.tracking, mapped.truth.size());
  EXPECT_LT(largest_error(found.slam, mapped), 0.05);
  EXPECT_LT(largest_error(found.odometry, mapped), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Drives, SlamWithoutOdometry, ::testing::Values(51U, 52U, 53U));

TEST(SlamWithoutOdometryByMrpt, IcpSlamMapsWithOdometryOfScans) {
  const test::SweptDrive drive = pose::drive(51);
  SlamOptions options = without_odometry(SlamEngine::mrpt_icp);
  auto slam = make_mapper(drive.robot, options);
  options.has_odometry = true;
  auto with = make_mapper(drive.robot, options);
  ASSERT_TRUE(slam.ok() && with.ok());
  const Followed found = follow(**slam, drive);
  const double with_odometry = largest_error(follow(**with, drive, Duration{}).slam, drive);
  const double error = largest_error(found.slam, drive);
  std::printf("MRPT's ICP-SLAM: %.3f m by scans alone, %.3f m with odometry\n", error, with_odometry);
  EXPECT_EQ(found.tracking, drive.truth.size());
  EXPECT_LT(error, 1.5 * with_odometry + 0.02);
}

TEST(OdometryByScans, GoesOnWhereItsMapIsBegunAnew) {
  const test::SweptDrive drive = test::swept_drive(54, kBeamInterval, kBeamInterval, 0, 4);
  OdometryByScans by_scans(drive.robot);
  std::vector<Pose2> found;
  for (const test::DriveInput& input : drive.inputs) {
    if (!input.scan) continue;
    const auto odometry = by_scans.add(*input.scan);
    ASSERT_TRUE(odometry);
    EXPECT_EQ(odometry->stamp, input.scan->stamp);
    found.push_back(planar(odometry->T_odom_base));
  }
  double driven = 0;
  for (std::size_t i = 1; i < found.size(); ++i) {
    const Pose2 step = found[i - 1].inverse() * found[i],
                truth = drive.truth[i - 1].inverse() * drive.truth[i];
    EXPECT_LT((step.position() - truth.position()).norm(), 0.05) << "scan " << i;
    EXPECT_LT(std::abs(wrap_angle(step.yaw - truth.yaw)), 0.03) << "scan " << i;
    driven += truth.position().norm() + std::abs(truth.yaw);
  }
  ASSERT_GT(driven, 60) << "keyframes are 0.15 m or 0.1 rad apart, and a map has 200 of them";
}

TEST(OdometryByScans, GivesNothingForAScanWithoutReturnsBeforeTheFirst) {
  const RobotDescription robot = test::robot_with_laser();
  OdometryByScans by_scans(robot);
  Scan scan;
  scan.ranges.assign(static_cast<std::size_t>(robot.laser->beams), std::numeric_limits<float>::infinity());
  EXPECT_FALSE(by_scans.add(scan));
}

TEST(OdometryOfAnotherClock, IsNamedAndScansShowTheMotion) {
  const test::SweptDrive drive = pose::drive(51);
  for (const Duration late : {seconds(-1.0e9), seconds(-3.0), seconds(3.0)}) {
    auto slam = make_mapper(drive.robot, {});
    ASSERT_TRUE(slam.ok()) << slam.error().message;
    const Followed found = follow(**slam, drive, late);
    EXPECT_LT(largest_error(found.slam, drive), 0.05) << late.seconds();
    const auto findings = (*slam)->odometry_findings();
    ASSERT_EQ(findings.size(), 1U) << late.seconds();
    EXPECT_EQ(findings[0].fault, OdometryFault::stamps_jumped);
    EXPECT_FALSE(findings[0].until);
  }
}

}  // namespace
}  // namespace parhelion::pose
