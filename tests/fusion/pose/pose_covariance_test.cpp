// Whether the covariance of a scan's pose is true, and the injection's limit right, on drives with known
// truth.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <string>

#include "tests/fusion/pose/matched_drive.hpp"

namespace parhelion::pose {
namespace {

using test::FollowedScan;

constexpr double kInside = 7.815;  ///< chi^2, 95 % of three degrees of freedom

struct Drive {
  std::string name;
  std::vector<FollowedScan> scans;
};

Drive drive_in(const std::string& name, const test::TrueBuilding& building,
               const test::TrueDriveOptions& options) {
  const test::TrueDrive drive = test::true_drive(building, test::robot_with_laser(), options);
  return {name, test::followed(drive, test::matching_map(building, drive.robot, options.range_sigma),
                               options.odometry_period)};
}

test::TrueBuilding ring() {
  test::TrueBuilding building;
  building.mapped = building.now = test::ring_building();
  for (int round = 0; round < 2; ++round)
    building.route.insert(building.route.end(), {{1.5, 1.2}, {10.5, 1.2}, {10.5, 6.8}, {1.8, 6}});
  return building;
}

/// Seeds and faults that nothing was tuned on.
const std::vector<Drive>& drives() {
  static const std::vector<Drive> all = [] {
    std::vector<Drive> made;
    const auto office = [&](const char* name, std::uint32_t seed, double moved, auto&& change) {
      test::TrueDriveOptions options;
      options.seed = seed;
      change(options);
      made.push_back(drive_in(name, test::office(seed, moved), options));
    };
    office("late", 21, 0, [](auto&) {});
    office("right", 22, 0, [](auto& o) { o.odometry_late = o.odometry_jitter = 0, o.odometry_scale = 1; });
    office("people, furniture", 23, 0.3, [](auto& o) { o.people = 5; });
    office("early, long", 24, 0.1, [](auto& o) { o.odometry_late = -0.1, o.odometry_scale = 1.1; });
    office("noisy laser", 25, 0, [](auto& o) { o.range_sigma = 0.02; });
    test::TrueDriveOptions options;
    options.seed = 26;
    options.people = 3;
    made.push_back(drive_in("ring", ring(), options));
    options.people = 0;
    made.push_back(drive_in("corridor", test::long_corridor(), options));
    return made;
  }();
  return all;
}

bool is_inside(const FollowedScan& scan) {
  constexpr int planar_rows[] = {0, 1, 5};
  const Pose2 used = planar(scan.used.T_map_base);
  const Eigen::Vector3d off(used.x - scan.truth.x, used.y - scan.truth.y,
                            wrap_angle(used.yaw - scan.truth.yaw));
  const Eigen::Matrix3d covariance = scan.used.covariance(planar_rows, planar_rows);
  return off.dot(covariance.inverse() * off) <= kInside;
}

struct Counts {
  double all = 0, inside = 0;
  void add(const FollowedScan& scan) {
    ++all;
    if (is_inside(scan)) ++inside;
  }
  double percent() const { return 100 * inside / all; }
};

TEST(PoseCovariance, ItsEllipsesHoldTheErrorsOnEachDrive) {
  Counts pooled, turning, straight;
  for (const Drive& drive : drives()) {
    Counts counts;
    for (const FollowedScan& scan : drive.scans) {
      counts.add(scan);
      pooled.add(scan);
      (std::abs(scan.true_twist.wz) > 0.1 ? turning : straight).add(scan);
    }
    RecordProperty(drive.name, std::to_string(counts.percent()));
    EXPECT_GT(counts.percent(), 90) << drive.name;
  }
  RecordProperty("pooled", std::to_string(pooled.percent()));
  RecordProperty("turning", std::to_string(turning.percent()));
  EXPECT_GT(pooled.percent(), 93);
  EXPECT_LT(pooled.percent(), 99);
  EXPECT_GT(turning.percent(), 92);
  EXPECT_LT(straight.percent(), 99.5);
}

TEST(PoseCovariance, PhantomsStandStill) {
  for (const Drive& drive : drives()) {
    if (drive.name == "corridor") continue;  // nothing shows where along it the robot is
    std::vector<double> errors;
    for (const FollowedScan& scan : drive.scans)
      errors.push_back(test::phantom_error(planar(scan.used.T_map_base), scan.truth));
    std::sort(errors.begin(), errors.end());
    const double median = errors.at(errors.size() / 2), p95 = errors.at(errors.size() * 95 / 100);
    RecordProperty(drive.name, std::to_string(1e3 * median) + " " + std::to_string(1e3 * p95));
    EXPECT_LT(median, 0.008) << drive.name;
    EXPECT_LT(p95, 0.02) << drive.name;
  }
}

/// Of the injection's limit: an agent 4 m before the robot.
struct Gate {
  double shown = 0, shown_wrong = 0, withheld = 0, withheld_right = 0;

  void add(const FollowedScan& scan, double limit) {
    const Eigen::Vector2d agent = scan.truth * Eigen::Vector2d(4, 0);
    const Pose2 used = planar(scan.used.T_map_base);
    const bool right = (used.inverse() * agent - scan.truth.inverse() * agent).norm() <= limit;
    const bool is_shown = predicted_error(scan.used, {agent.x(), agent.y(), 0}) <= limit;
    ++(is_shown ? shown : withheld);
    if (is_shown && !right) ++shown_wrong;
    if (!is_shown && right) ++withheld_right;
  }
};

TEST(PoseCovariance, NothingIsShownFarFromWhereItBelongs) {
  constexpr double limit = 0.1;  // m
  Gate gate;
  for (const Drive& drive : drives())
    for (const FollowedScan& scan : drive.scans) gate.add(scan, limit);
  for (const auto& [name, count] : {std::pair{"shown", gate.shown},
                                    {"shown_wrong", gate.shown_wrong},
                                    {"withheld", gate.withheld},
                                    {"withheld_right", gate.withheld_right}})
    RecordProperty(name, std::to_string(count));
  EXPECT_LT(gate.shown_wrong, 0.01 * gate.shown);
  EXPECT_LT(gate.withheld, 0.02 * (gate.shown + gate.withheld));
}

}  // namespace
}  // namespace parhelion::pose
