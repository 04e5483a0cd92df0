// Whether the covariance that SLAM reports is true, on true_drives with known truth: mapping, far from the
// start and after loops, and localized in a map.
#include <gtest/gtest.h>

#include "fusion/pose/slam.hpp"
#include "tests/fusion/pose/corrupted_odometry.hpp"
#include "tests/fusion/pose/estimate_error.hpp"
#include "tests/fusion/pose/true_drive.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::pose {
namespace {

/// Offices have a corridor of 22 m, which is driven there and back. Seeds that nothing was
/// tuned on.
struct SlamDrive {
  const char* name;
  std::uint32_t seed;
  test::TrueDriveOptions options;
  double moved = 0;
};

std::vector<SlamDrive> true_drives() {
  std::vector<SlamDrive> all{
      {"late", 71, {}},        {"right", 72, {}},      {"people, furniture", 73, {}, 0.3},
      {"noisy laser", 74, {}}, {"slow laser", 75, {}}, {"second seed", 76, {}}};
  for (SlamDrive& drive : all) drive.options.seed = drive.seed;
  all[1].options.odometry_late = all[1].options.odometry_jitter = 0;
  all[2].options.people = 5;
  all[3].options.range_sigma = 0.02;
  all[4].options.scan_period = 0.25;
  return all;
}

struct SlamCounts {
  int all = 0, inside = 0;
  double largest_sigma = 0;  ///< m, of a position
  double percent() const { return 100.0 * inside / all; }
  void add(bool is_inside) { ++all, inside += is_inside ? 1 : 0; }
};

/// `T_true_map`: where the map's origin is in the building.
bool is_inside(const PoseEstimate& estimate, const Pose2& truth, const Pose2& T_true_map) {
  return test::holds_pose(test::planar_covariance(estimate),
                          test::planar_error(planar(estimate.T_map_base), T_true_map.inverse() * truth));
}

SlamCounts counted(Slam& slam, const test::TrueDrive& drive, bool from_the_start) {
  SlamCounts counts;
  std::optional<Pose2> T_true_map;
  if (!from_the_start) T_true_map = Pose2{};
  for (const test::DriveInput& input : test::inputs_of(drive)) {
    if (!input.scan) {
      slam.add(input.odometry);
      continue;
    }
    const auto estimate = slam.add(*input.scan);
    if (!estimate || estimate->state != SlamState::tracking) continue;
    const Pose2 truth = drive.at(estimate->stamp);
    if (!T_true_map) T_true_map = truth * planar(estimate->T_map_base).inverse();
    counts.add(is_inside(*estimate, truth, *T_true_map));
    const double variance = std::max(estimate->covariance(0, 0), estimate->covariance(1, 1));
    counts.largest_sigma = std::max(counts.largest_sigma, std::sqrt(variance));
  }
  return counts;
}

TEST(SlamCovariance, HoldsTheErrorsWhileMapping) {
  SlamCounts pooled;
  for (const SlamDrive& each : true_drives()) {
    const auto drive =
        test::true_drive(test::office(each.seed, each.moved), test::robot_with_laser(), each.options);
    auto slam = make_mapper(drive.robot, {});
    ASSERT_TRUE(slam.ok());
    const SlamCounts counts = counted(**slam, drive, true);
    std::printf("mapping, %s: %.1f %% of %d\n", each.name, counts.percent(), counts.all);
    // Drift is one error for a whole stretch: a drive has two or three of them.
    EXPECT_GT(counts.percent(), 75) << each.name;
    pooled.all += counts.all, pooled.inside += counts.inside;
    pooled.largest_sigma = std::max(pooled.largest_sigma, counts.largest_sigma);
  }
  std::printf("mapping, pooled: %.1f %%, largest sigma %.3f m\n", pooled.percent(), pooled.largest_sigma);
  EXPECT_GT(pooled.percent(), 93);
  EXPECT_LT(pooled.largest_sigma, 0.2) << "a covariance that holds everything says nothing";
}

TEST(SlamCovariance, HoldsTheErrorsOfARobotThatIsLocalized) {
  SlamCounts pooled;
  for (const SlamDrive& each : true_drives()) {
    const auto building = test::office(each.seed, each.moved);
    const auto drive = test::true_drive(building, test::robot_with_laser(), each.options);
    const test::TemporaryFolder folder;
    const std::string map = folder / "map.simplemap";
    ASSERT_TRUE(write_simplemap(test::true_map(building, drive.robot, each.options.range_sigma), map).ok());
    SlamOptions options;
    const Pose2 start = drive.path.at(0);
    options.start = Eigen::Vector3d(start.x, start.y, start.yaw);
    auto slam = make_localizer(drive.robot, map, options);
    ASSERT_TRUE(slam.ok()) << slam.error().message;
    const SlamCounts counts = counted(**slam, drive, false);
    std::printf("localized, %s: %.1f %% of %d\n", each.name, counts.percent(), counts.all);
    EXPECT_GT(counts.percent(), 90) << each.name;
    pooled.all += counts.all, pooled.inside += counts.inside;
  }
  std::printf("localized, pooled: %.1f %%\n", pooled.percent());
  EXPECT_GT(pooled.percent(), 93);
  EXPECT_LT(pooled.percent(), 99) << "a covariance that holds everything says nothing";
}

}  // namespace
}  // namespace parhelion::pose
