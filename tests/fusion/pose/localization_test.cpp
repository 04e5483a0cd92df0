// Localization that is never falsely certain: anywhere in buildings where many places look alike and which
// have changed since they were mapped, and after the robot has been carried away.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <memory>

#include "fusion/pose/own_slam.hpp"
#include "fusion/pose/search/localizer_search.hpp"
#include "protocols/quantile.hpp"
#include "tests/fusion/pose/kidnapped_drive.hpp"
#include "tests/long_run.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::pose {
namespace {

using test::BuildingOptions;
using test::KidnappedDrive;
using test::KidnappedOptions;
using test::RepeatingBuilding;

struct MappedBuilding {
  RepeatingBuilding building;
  std::shared_ptr<const FrozenMap> map;
};

MappedBuilding mapped_building(std::uint32_t seed, const BuildingOptions& options) {
  MappedBuilding result{test::repeating_building(seed, options), nullptr};
  const auto scans = test::true_map(result.building.walls, test::robot_with_laser());
  result.map = std::make_shared<const FrozenMap>(frozen_map_of(scans, 0));
  return result;
}

/// Mapped like mapped_building(), but written as a ROS map and read again.
MappedBuilding gridded_building(std::uint32_t seed, const BuildingOptions& options) {
  MappedBuilding result{test::repeating_building(seed, options), nullptr};
  const auto scans = test::true_map(result.building.walls, test::robot_with_laser());
  const test::TemporaryFolder folder;
  EXPECT_TRUE(save_ros_map(grid_of(scans, 0.05), folder / "grid").ok());
  auto map = load_frozen_map(folder / "grid.yaml", 0.05);
  EXPECT_TRUE(map.ok());
  if (map) result.map = std::make_shared<const FrozenMap>(std::move(*map));
  return result;
}

/// One estimate for each scan.
std::vector<PoseEstimate> localized(const std::shared_ptr<const FrozenMap>& map, const KidnappedDrive& drive,
                                    const SlamOptions& options) {
  const auto slam = make_own_localizer(drive.robot, map, options);
  std::vector<PoseEstimate> estimates;
  auto odometry = drive.odometry.begin();
  for (const test::TrueScan& at : drive.scans) {
    for (; odometry != drive.odometry.end() && odometry->stamp <= at.scan.stamp; ++odometry)
      slam->add(*odometry);
    const auto estimate = slam->add(at.scan);
    estimates.push_back(estimate.value_or(PoseEstimate{}));
  }
  return estimates;
}

double seconds_of(const test::TrueScan& at) {
  return (at.scan.stamp - SensorTime{test::TrueDrive::kStart}).seconds();
}

struct Off {
  double position, yaw;  ///< m, rad
  bool beyond;           ///< 3 of the estimate's own sigmas
};

Off off(const PoseEstimate& estimate, const Pose2& truth) {
  const Pose2 found = planar(estimate.T_map_base);
  const Eigen::Vector2d e = found.position() - truth.position();
  const double yaw = std::abs(wrap_angle(found.yaw - truth.yaw));
  const Eigen::Matrix2d covariance = estimate.covariance.topLeftCorner<2, 2>();
  const bool beyond = e.dot(covariance.inverse() * e) > 9 || yaw * yaw > 9 * estimate.covariance(5, 5);
  return {e.norm(), yaw, beyond};
}

bool is_tracking(const PoseEstimate& estimate) { return estimate.state == SlamState::tracking; }

struct Starts {
  int all = 0, in_time = 0, later = 0, wrong = 0;  ///< within 5 s; after that
};

/// Anywhere, without a known start, for 10 s.
void add_start(Starts& starts, const MappedBuilding& in, std::uint32_t seed) {
  KidnappedOptions options;
  options.drive.seed = seed;
  options.drive.people = static_cast<int>(seed % 3);
  const KidnappedDrive drive = kidnapped_drive(in.building, options);
  const auto estimates = localized(in.map, drive, {});
  std::optional<double> first;
  bool wrong = false;
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    if (!is_tracking(estimates[i])) continue;
    if (!first) first = seconds_of(drive.scans[i]) - seconds_of(drive.scans[0]);
    const Off error = off(estimates[i], drive.scans[i].T_map_base);
    wrong |= error.position > 0.5 || error.yaw > 0.17;
  }
  ++starts.all;
  starts.in_time += first && *first <= 5 ? 1 : 0;
  starts.later += first && *first > 5 ? 1 : 0;
  starts.wrong += wrong ? 1 : 0;
  if (wrong) std::printf("  start %u is wrong\n", seed);
}

Starts starts_in(const BuildingOptions& options, std::uint32_t buildings, std::uint32_t each) {
  Starts starts;
  for (std::uint32_t b = 0; b < buildings; ++b) {
    const MappedBuilding in = mapped_building(b + 1, options);
    for (std::uint32_t i = 0; i < each; ++i) add_start(starts, in, 100 * b + i);
  }
  std::printf("%d starts: %d found within 5 s, %d later, %d wrong\n", starts.all, starts.in_time,
              starts.later, starts.wrong);
  return starts;
}

TEST(Localization, FindsItselfInABuildingWhoseRoomsDiffer) {
  const bool all = test::long_run();
  const Starts starts = starts_in({.moved = 0.2, .doors = 0.3, .alike = 0}, all ? 4 : 1, all ? 10 : 8);
  EXPECT_EQ(starts.wrong, 0);
  EXPECT_GE(starts.in_time, starts.all * 2 / 10);
}

TEST(Localization, StartsAnywhereInABuildingOfOfficesThatLookAlikeAndIsNeverWrong) {
  const bool all = test::long_run();
  const Starts starts = starts_in({.moved = 0.3, .doors = 0.3, .cupboards = 1}, all ? 5 : 1, all ? 20 : 8);
  EXPECT_EQ(starts.wrong, 0);
  EXPECT_GE(starts.in_time, starts.all / 10);
}

TEST(Localization, DoesNotChooseBetweenTwoIdenticalWings) {
  const bool all = test::long_run();
  const Starts same = starts_in({.symmetric = true}, all ? 4 : 1, all ? 10 : 4);
  EXPECT_EQ(same.in_time + same.later, 0);
  // What has changed in one wing is no landmark.
  const Starts changed =
      starts_in({.moved = 0.3, .doors = 0.3, .cupboards = 1, .symmetric = true}, all ? 4 : 1, all ? 10 : 4);
  EXPECT_EQ(changed.in_time + changed.later, 0);
}

SlamOptions started_at(const KidnappedDrive& drive) {
  SlamOptions options;
  const Pose2& pose = drive.scans.front().T_map_base;
  options.start = Eigen::Vector3d(pose.x, pose.y, pose.yaw);
  return options;
}

struct Accuracy {
  std::vector<double> errors;        ///< m, of estimates in state tracking
  std::size_t scans = 0, wrong = 0;  ///< wrong: tracking, and off by more than 0.3 m or 10 degrees
  double unmapped = 0;               ///< mean fraction of beams
  double overconfident = 0;          ///< s, the longest time beyond 3 sigmas
};

void add_drive(Accuracy& accuracy, const MappedBuilding& in, std::uint32_t seed) {
  KidnappedOptions options;
  options.drive.seed = seed;
  options.drive.people = 3;
  options.seconds = 40;
  const KidnappedDrive drive = kidnapped_drive(in.building, options);
  const auto estimates = localized(in.map, drive, started_at(drive));
  double beyond_since = -1;
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    const double now = seconds_of(drive.scans[i]);
    const Off error = off(estimates[i], drive.scans[i].T_map_base);
    if (is_tracking(estimates[i])) {
      accuracy.errors.push_back(error.position);
      accuracy.wrong += error.position > 0.3 || error.yaw > 0.17 ? 1 : 0;
    }
    if (!is_tracking(estimates[i]) || !error.beyond)
      beyond_since = -1;
    else if (beyond_since < 0)
      beyond_since = now;
    if (beyond_since >= 0) accuracy.overconfident = std::max(accuracy.overconfident, now - beyond_since);
  }
  accuracy.scans += estimates.size();
  accuracy.unmapped += drive.unmapped;
}

/// Drives of 40 s with a known start, among three people.
template <class MakeMap>
Accuracy accuracy_in(const BuildingOptions& options, std::uint32_t first, std::uint32_t buildings,
                     std::uint32_t each, const MakeMap& make_map) {
  Accuracy accuracy;
  for (std::uint32_t b = 0; b < buildings; ++b) {
    const MappedBuilding in = make_map(first + b, options);
    for (std::uint32_t i = 0; i < each; ++i) add_drive(accuracy, in, 100 * b + i);
  }
  accuracy.unmapped /= buildings * each;
  return accuracy;
}

TEST(Localization, StaysRightInABuildingThatHasChanged) {
  Accuracy accuracy = accuracy_in({.moved = 0.5, .doors = 0.5, .cupboards = 2}, 11, 1, 4, mapped_building);
  const double tracking = static_cast<double>(accuracy.errors.size()) / static_cast<double>(accuracy.scans);
  const double p50 = quantile(accuracy.errors, 0.5), p95 = quantile(accuracy.errors, 0.95);
  std::printf(
      "%.0f %% of beams not mapped, %.1f %% tracking, error %.3f, p95 %.3f, max %.3f m; over 3 sigmas for "
      "%.1f s\n",
      100 * accuracy.unmapped, 100 * tracking, p50, p95, quantile(accuracy.errors, 1),
      accuracy.overconfident);
  EXPECT_GT(accuracy.unmapped, 0.2);
  EXPECT_GT(tracking, 0.9);
  EXPECT_LT(p50, 0.01);
  EXPECT_LT(p95, 0.03);
  EXPECT_LE(accuracy.overconfident, 1);
}

TEST(Localization, IsHardlyEverWrongWhereAThirdOfAllBeamsEndOnNewThings) {
  const bool all = test::long_run();
  Accuracy accuracy = accuracy_in({.moved = 0.5, .doors = 0.5, .cupboards = 4}, all ? 61 : 11, all ? 8 : 1,
                                  all ? 3 : 4, mapped_building);
  const auto scans = static_cast<double>(accuracy.scans);
  const double tracking = static_cast<double>(accuracy.errors.size()) / scans;
  const double wrong = static_cast<double>(accuracy.wrong) / scans, p95 = quantile(accuracy.errors, 0.95);
  std::printf(
      "%.0f %% of beams not mapped, %.1f %% tracking, p95 %.3f, max %.3f m; wrong in %.2f %% of scans\n",
      100 * accuracy.unmapped, 100 * tracking, p95, quantile(accuracy.errors, 1), 100 * wrong);
  EXPECT_GT(accuracy.unmapped, 0.25);
  EXPECT_GT(tracking, 0.6);
  EXPECT_LT(p95, 0.1);
  EXPECT_LT(wrong, 0.025);
}

TEST(Localization, StaysRightInARosMapOfABuildingThatHasChanged) {
  const bool all = test::long_run();
  Accuracy accuracy = accuracy_in({.moved = 0.3, .doors = 0.3, .cupboards = 1}, 31, all ? 6 : 1, all ? 4 : 3,
                                  gridded_building);
  const double tracking = static_cast<double>(accuracy.errors.size()) / static_cast<double>(accuracy.scans);
  const double p50 = quantile(accuracy.errors, 0.5), p95 = quantile(accuracy.errors, 0.95);
  std::printf(
      "%.0f %% of beams not mapped, %.1f %% tracking, error %.3f, p95 %.3f, max %.3f m; over 3 sigmas for "
      "%.1f s\n",
      100 * accuracy.unmapped, 100 * tracking, p50, p95, quantile(accuracy.errors, 1),
      accuracy.overconfident);
  EXPECT_GT(accuracy.unmapped, 0.1);
  EXPECT_GT(tracking, 0.9);
  EXPECT_LT(p50, 0.02);
  EXPECT_LT(p95, 0.05);
  EXPECT_LE(accuracy.overconfident, all ? 2 : 1);  // the longest of 24 drives, and of 3
}

TEST(Localization, TheGridOfAMapKeepsWhatScansHaveHit) {
  const auto scans = test::true_map(test::repeating_building(5, {}).walls, test::robot_with_laser());
  const GridMap grid = grid_of(scans, 0.05);
  std::size_t hits = 0, kept = 0;
  for (const MappedScan& scan : scans) {
    for (const Eigen::Vector2d& p : points_of(scan)) {
      const Eigen::Vector2d cell =
          ((scan.T_map_base * p - Eigen::Vector2d(grid.x_min, grid.y_min)) / grid.resolution).array().floor();
      const auto index = static_cast<std::size_t>(cell.y()) * static_cast<std::size_t>(grid.width) +
                         static_cast<std::size_t>(cell.x());
      ++hits;
      kept += grid.occupied[index] > 0.65F;
    }
  }
  const double fraction = static_cast<double>(kept) / static_cast<double>(hits);
  std::printf("%.1f %% of the returns lie in occupied cells\n", 100 * fraction);
  EXPECT_GT(fraction, 0.95);
}

/// The place that a whole search finds in one of two identical wings, told that the robot is expected `off`
/// (m, along the corridor) from where it is.
std::optional<Pose2> found_in_identical_wings(double off, Pose2& truth) {
  const MappedBuilding in = mapped_building(1, {.symmetric = true});
  KidnappedOptions options;
  options.drive.seed = 3;
  options.seconds = 12;
  const KidnappedDrive drive = kidnapped_drive(in.building, options);
  GlobalSearch search;
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    truth = drive.scans[i].T_map_base;
    const Pose2 step = i > 0 ? drive.scans[i - 1].T_map_base.inverse() * truth : Pose2{};
    const Vicinity expected{{truth.x + off, truth.y, truth.yaw}, 0.4, 0.2};
    const ScanPoints points = deskewed(drive.scans[i].scan, *drive.robot.laser, {});
    if (const auto found = search.add(*in.map, points, step, expected)) return found;
  }
  return std::nullopt;
}

TEST(GlobalSearch, DoesNotBelieveAnExpectationThatScansContradict) {
  Pose2 truth;
  EXPECT_FALSE(found_in_identical_wings(3, truth));
}

struct Kidnaps {
  int all = 0, late = 0, wrong = 0, found = 0, found_later = 0;
};

void add_kidnap(Kidnaps& kidnaps, const MappedBuilding& in, std::uint32_t seed, double carried, bool silent) {
  KidnappedOptions options;
  options.drive.seed = seed;
  options.since = 4 + 0.1 * (seed * 37 % 40);
  options.carried = carried;
  options.silent = silent;
  options.seconds = *options.since + carried + 10;
  const KidnappedDrive drive = kidnapped_drive(in.building, options);
  const auto estimates = localized(in.map, drive, started_at(drive));
  bool left = false, wrong = false, before = false;
  std::optional<double> again;
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    const double after = seconds_of(drive.scans[i]) - *options.since;
    const Off error = off(estimates[i], drive.scans[i].T_map_base);
    if (after < 0) before = is_tracking(estimates[i]);
    if (after >= 0 && after <= 1) left |= !is_tracking(estimates[i]);
    if (after > 1 && is_tracking(estimates[i])) {
      wrong |= error.position > 0.3;
      if (after > carried && !again) again = after - carried;
    }
  }
  EXPECT_TRUE(before) << seed;
  ++kidnaps.all;
  kidnaps.late += left ? 0 : 1;
  kidnaps.wrong += wrong ? 1 : 0;
  kidnaps.found += again && *again <= 5 ? 1 : 0;
  kidnaps.found_later += again && *again > 5 ? 1 : 0;
  if (!left || wrong)
    std::printf("  carried robot %u: %s%s\n", seed, left ? "" : "not noticed ", wrong ? "wrong" : "");
}

Kidnaps kidnaps_in(const BuildingOptions& options, int each, double carried, bool silent) {
  constexpr int robots_per_building = 5;
  Kidnaps kidnaps;
  MappedBuilding in;
  for (int i = 0; i < each; ++i) {
    if (i % robots_per_building == 0)
      in = mapped_building(static_cast<std::uint32_t>(21 + i / robots_per_building), options);
    add_kidnap(kidnaps, in, static_cast<std::uint32_t>(i + 1), carried, silent);
  }
  std::printf(
      "carried for %.0f s, odometry %s: %d robots, %d not noticed within 1 s, %d wrong, %d found within 5 s, "
      "%d later\n",
      carried, silent ? "silent" : "still", kidnaps.all, kidnaps.late, kidnaps.wrong, kidnaps.found,
      kidnaps.found_later);
  return kidnaps;
}

/// Seconds for which it is carried, and whether odometry is silent then.
class CarriedRobot : public ::testing::TestWithParam<std::pair<int, bool>> {};

TEST_P(CarriedRobot, IsNoticedWithinASecondAndHardlyEverTrackedAtAWrongPlace) {
  const auto [carried, silent] = GetParam();
  const Kidnaps kidnaps = kidnaps_in({.moved = 0.2, .doors = 0.3, .cupboards = 1, .alike = 0.2},
                                     test::long_run() ? 20 : 4, carried, silent);
  EXPECT_EQ(kidnaps.late, 0);
  // Robot 1, put down where half of its beams end on things that are not in the map, is found elsewhere.
  EXPECT_LE(kidnaps.wrong, 1);
}

TEST_P(CarriedRobot, IsNotFoundInTheWrongOneOfTwoIdenticalWings) {
  const auto [carried, silent] = GetParam();
  const Kidnaps kidnaps = kidnaps_in({.symmetric = true}, test::long_run() ? 10 : 2, carried, silent);
  EXPECT_EQ(kidnaps.late, 0);
  EXPECT_EQ(kidnaps.wrong, 0);
}

INSTANTIATE_TEST_SUITE_P(Kinds, CarriedRobot,
                         ::testing::Values(std::pair(0, false), std::pair(0, true), std::pair(3, false),
                                           std::pair(3, true)));

}  // namespace
}  // namespace parhelion::pose
