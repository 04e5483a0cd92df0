// Odometry's time offset and scale while the robot drives, against what the generated drive was given.
#include "fusion/pose/odometry/online_odometry_calibration.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/allocations.hpp"
#include "tests/fusion/pose/matched_drive.hpp"

namespace parhelion::pose {
namespace {

using test::FollowedScan;

struct Fault {
  double late = 0, scale = 1;  ///< s
  test::StampShift shift = [](double) { return 0.0; };
  double slip = 0;  ///< s of each 15
  int people = 2;
  std::uint32_t seed = 1;
};

std::vector<FollowedScan> drive_with(const Fault& fault, bool calibrated = true) {
  test::TrueDriveOptions options;
  options.seed = fault.seed;
  options.people = fault.people;
  options.odometry_late = fault.late;
  options.odometry_scale = fault.scale;
  options.odometry_jitter = 0.005;
  const test::TrueBuilding building = test::office(fault.seed, 0.1);
  test::TrueDrive drive = test::true_drive(building, test::robot_with_laser(), options);
  test::shift_odometry(fault.shift, options.odometry_period, drive);
  if (fault.slip > 0) test::let_slip(fault.slip, 15, options.odometry_period, drive);
  PoseTrackOptions track;
  track.calibrate_odometry = calibrated;
  return test::followed(drive, test::matching_map(building, drive.robot), options.odometry_period, track);
}

/// Largest errors from `from` s on.
struct Worst {
  double offset = 0, translation = 0, rotation = 0;
};

Worst worst_of(const std::vector<FollowedScan>& scans, const Fault& fault, double from = 30) {
  Worst worst;
  for (const FollowedScan& scan : scans) {
    if (scan.t < from) continue;
    const OdometryCorrection& c = scan.calibration;
    worst.offset = std::max(worst.offset, std::abs(c.time_offset + fault.late + fault.shift(scan.t)));
    worst.translation = std::max(worst.translation, std::abs(c.translation_scale * fault.scale - 1));
    worst.rotation = std::max(worst.rotation, std::abs(c.rotation_scale * fault.scale - 1));
  }
  return worst;
}

/// m, of phantoms: as predicted by odometry at the scan's stamp.
double predicted_p95(const std::vector<FollowedScan>& scans) {
  std::vector<double> errors;
  for (const FollowedScan& scan : scans)
    if (scan.t > 30) errors.push_back(test::phantom_error(scan.predicted, scan.truth));
  std::sort(errors.begin(), errors.end());
  return errors.at(errors.size() * 95 / 100);
}

void expect_found(const Fault& fault) {
  const Worst worst = worst_of(drive_with(fault), fault);
  EXPECT_LT(worst.offset, 0.015);
  EXPECT_LT(worst.translation, 0.015);
  EXPECT_LT(worst.rotation, 0.015);
}

TEST(OnlineOdometryCalibration, FindsNothingWhereOdometryIsRight) { expect_found({}); }
TEST(OnlineOdometryCalibration, FindsOdometryThatIsLate) { expect_found({.late = 0.1, .seed = 2}); }
TEST(OnlineOdometryCalibration, FindsScales) {
  expect_found({.scale = 0.9, .seed = 3});
  expect_found({.scale = 1.1, .seed = 4});
}
TEST(OnlineOdometryCalibration, IsNotMovedByPeople) {
  expect_found({.late = 0.1, .scale = 1.02, .people = 8, .seed = 5});
}

TEST(OnlineOdometryCalibration, MakesPredictionsRightWhereOdometryIsEarly) {
  const Fault fault{.late = -0.1, .scale = 1.03, .seed = 6};
  expect_found(fault);
  const double with = predicted_p95(drive_with(fault)), without = predicted_p95(drive_with(fault, false));
  RecordProperty("with_mm", std::to_string(1e3 * with));
  RecordProperty("without_mm", std::to_string(1e3 * without));
  EXPECT_LT(with, 0.6 * without);
}

TEST(OnlineOdometryCalibration, FollowsAnOffsetThatDrifts) {
  const Fault fault{.late = 0.02, .shift = [](double t) { return 0.05 * t / 180; }, .seed = 7};
  EXPECT_LT(worst_of(drive_with(fault), fault).offset, 0.025);
}

TEST(OnlineOdometryCalibration, FollowsAnOffsetThatJumps) {
  const Fault fault{.shift = [](double t) { return t > 80 ? 0.1 : 0.0; }, .seed = 8};
  const auto scans = drive_with(fault);
  EXPECT_LT(worst_of(scans, fault, 125).offset, 0.02);
  const double jump = worst_of(scans, fault, 79).offset;
  EXPECT_GT(jump, 0.09) << "a slow estimate does not jump with it";
}

TEST(OnlineOdometryCalibration, IsHardlyMovedBySlip) {
  const Fault fault{.late = 0.05, .slip = 3, .seed = 9};
  const Worst worst = worst_of(drive_with(fault), fault);
  EXPECT_LT(worst.offset, 0.02);
  EXPECT_LT(worst.translation, 0.06) << "the mean over the slip is 0.1";
}

TEST(OnlineOdometryCalibration, StaysWithinItsBounds) {
  for (const FollowedScan& scan : drive_with({.late = 0.6, .scale = 1.5, .seed = 10})) {
    const OdometryCorrection& c = scan.calibration;
    EXPECT_LE(std::abs(c.time_offset), OnlineOdometryCalibration::kMaxOffset);
    EXPECT_LE(std::abs(c.translation_scale - 1), OnlineOdometryCalibration::kMaxScale + 1e-12);
    EXPECT_LE(std::abs(c.rotation_scale - 1), OnlineOdometryCalibration::kMaxScale + 1e-12);
  }
}

SensorTime at(double t) { return SensorTime{test::TrueDrive::kStart} + seconds(t); }

TEST(OnlineOdometryCalibration, DoesNotDriftWhileTheRobotStands) {
  OnlineOdometryCalibration calibration;
  std::mt19937 random(1);
  std::normal_distribution<double> noise;
  const Eigen::Matrix3d covariance = Eigen::Vector3d(4e-6, 4e-6, 1e-6).asDiagonal();
  const test::AllocationWatch watch;
  for (int i = 0; i < 20'000; ++i) {
    const double t = 0.05 * i;
    calibration.add(Odometry{at(t), transform<Odom, Base>(Pose2{1, 2, 3})});
    if (i % 2 == 0)
      calibration.add(at(t + 0.01), {0.002 * noise(random), 0.002 * noise(random), 0.001 * noise(random)},
                      covariance);
  }
  EXPECT_EQ(watch.count(), 0U);
  EXPECT_EQ(calibration.estimate(), OdometryCorrection{});
}

TEST(FollowedCorrection, PassesOdometryUnchangedWithoutAnEstimate) {
  FollowedCorrection followed;
  for (int i = 0; i < 10; ++i) {
    const Odometry sample{at(0.1 * i), transform<Odom, Base>(Pose2{0.1 * i, 0.3, 0.2 * i})};
    const Odometry out = followed(sample, {});
    EXPECT_EQ(out.stamp, sample.stamp);
    EXPECT_EQ(planar(out.T_odom_base).x, planar(sample.T_odom_base).x);
    EXPECT_EQ(planar(out.T_odom_base).yaw, planar(sample.T_odom_base).yaw);
  }
}

TEST(FollowedCorrection, ChangesStampsSlowlyAndScalesSteps) {
  FollowedCorrection followed;
  const OdometryCorrection estimate{.translation_scale = 1.1, .time_offset = -0.1};
  SensorTime last{};
  double x = 0;
  for (int i = 0; i < 200; ++i) {
    const Odometry out = followed({at(0.05 * i), transform<Odom, Base>(Pose2{0.05 * i, 0, 0})},
                                  i < 20 ? OdometryCorrection{} : estimate);
    EXPECT_GT(out.stamp, last);
    const double offset = (out.stamp - at(0.05 * i)).seconds();
    EXPECT_NEAR(offset, std::max(-0.1, -0.02 * 0.05 * std::max(0, i - 19)), 1e-6);
    last = out.stamp;
    x = planar(out.T_odom_base).x;
  }
  EXPECT_NEAR((last - at(0.05 * 199)).seconds(), -0.1, 1e-6);
  EXPECT_NEAR(x, 0.05 * 19 + 1.1 * 0.05 * 180, 1e-9);
}

}  // namespace
}  // namespace parhelion::pose
