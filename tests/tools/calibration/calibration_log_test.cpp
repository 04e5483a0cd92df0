// `parhelion calibrate` over a log of a drive whose errors are known.
#include "tools/calibration/calibration_log.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>

#include "tests/temporary_folder.hpp"
#include "tests/tools/calibration/logged_drive.hpp"
#include "tests/tools/process.hpp"
#include "tools/calibration/calibration_verdict.hpp"

namespace parhelion::tools {
namespace {

using pose::Measured;
using pose::MotionParameter;
using test::Fault;
using test::kCameraOffset;
using test::kImuBias;
using test::kImuOffset;
using test::kImuScale;
using test::LoggedDrive;

void expect_within(const Measured& found, double truth, const char* what) {
  EXPECT_TRUE(found.shown) << what << ", sigma " << found.sigma;
  EXPECT_LE(std::abs(found.value - truth), 3 * found.sigma)
      << what << ": " << found.value << " +- " << found.sigma << ", true " << truth;
}

CalibrationOptions options_for(const char* name, double validation) {
  CalibrationOptions options;
  options.input = std::filesystem::path(testing::TempDir()) / name;
  options.validation_fraction = validation;
  return options;
}

TEST(CalibrationLog, CalibratesAllSensorsOfADrive) {
  for (std::uint32_t seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE(seed);
    const test::DriveErrors errors;
    const CalibrationOptions options = options_for("all_sensors.lcm", 0.25);
    LoggedDrive(seed, errors, true).write(options.input);
    const auto report = calibrate_log(options);
    ASSERT_TRUE(report.ok()) << report.error().message;
    const OdometryCorrection& odometry = errors.odometry;
    expect_within(report->motion[MotionParameter::translation_scale], odometry.translation_scale,
                  "translation");
    expect_within(report->motion[MotionParameter::rotation_scale], odometry.rotation_scale, "rotation");
    expect_within(report->motion[MotionParameter::time_offset], odometry.time_offset, "odometry's offset");
    ASSERT_TRUE(report->imu.found) << report->imu.note;
    expect_within(report->imu.found->time_offset, kImuOffset, "IMU's offset");
    expect_within(report->imu.found->scale, kImuScale, "IMU's scale");
    expect_within(report->imu.found->bias, kImuBias, "IMU's bias");
    ASSERT_TRUE(report->camera.found) << report->camera.note;
    expect_within(report->camera.found->time_offset, kCameraOffset, "camera's offset");
    // What is written is what was found, and holds where it was not fitted.
    const auto written = parse_robot_description(to_yaml(report->after), "after");
    ASSERT_TRUE(written.ok()) << written.error().message;
    EXPECT_NEAR(written->imu->time_offset, kImuOffset, 0.005);
    EXPECT_NEAR(written->camera->time_offset, kCameraOffset, 0.02);
    EXPECT_LT(report->check_after.position_rms, 0.5 * report->check_before.position_rms);
    EXPECT_LT(report->check_after.yaw_rms, 0.5 * report->check_before.yaw_rms);
    EXPECT_EQ(report->verdict, CalibrationVerdict::better);
    const std::string text = to_text(*report, options);
    EXPECT_NE(text.find("IMU against odometry"), std::string::npos) << text;
    EXPECT_NE(to_json(*report, options).find("\"camera\""), std::string::npos);
    std::filesystem::remove(options.input);
  }
}

// Its noise must not be taken for the motion of the laser during a sweep: the offset would run away from
// round to round.
TEST(CalibrationLog, StaysTrueWhereOdometryIsRough) {
  for (std::uint32_t seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE(seed);
    test::DriveErrors errors;
    errors.odometry_noise = errors.odometry_turn_noise = 0.008;
    const CalibrationOptions options = options_for("rough_odometry.lcm", 0);
    LoggedDrive(seed, errors, false).write(options.input);
    const auto report = calibrate_log(options);
    ASSERT_TRUE(report.ok()) << report.error().message;
    expect_within(report->motion[MotionParameter::rotation_scale], errors.odometry.rotation_scale,
                  "rotation");
    expect_within(report->motion[MotionParameter::time_offset], errors.odometry.time_offset,
                  "odometry's offset");
    ASSERT_TRUE(report->imu.found) << report->imu.note;
    expect_within(report->imu.found->time_offset, kImuOffset, "IMU's offset");
    std::filesystem::remove(options.input);
  }
}

TEST(CalibrationLog, FindsTheHeightOfTheLaserInDepthImages) {
  constexpr double kLow = 0.38, kHigh = 0.46;  // m: what hangs there and stops beams
  const CalibrationOptions options = options_for("depth.lcm", 0);
  LoggedDrive drive(3, {}, false, {}, 1);
  drive.add_depth(kLow, kHigh);
  drive.write(options.input);
  const auto report = calibrate_log(options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_TRUE(report->level.found) << report->level.note;
  EXPECT_GT(report->level.found->agreeing, 0.9);
  expect_within(report->level.found->height, (kLow + kHigh) / 2, "height");
  EXPECT_EQ(report->after.laser->T_base_laser.translation().z(), report->level.found->height.value);
  EXPECT_NE(to_text(*report, options).find("laser height"), std::string::npos);
  EXPECT_NE(to_json(*report, options).find("laser_height_mm"), std::string::npos);
  EXPECT_NE(to_json(*report, options).find("higher_mm"), std::string::npos);
  std::filesystem::remove(options.input);
}

// A slow sweep: poses that the first round makes lean towards the odometry at hand at each scan.
TEST(CalibrationLog, FindsNoTimeOffsetInAShortDriveThatHasNone) {
  test::DriveErrors errors;
  errors.odometry.time_offset = errors.stamp_jitter = errors.slip = 0;
  const CalibrationOptions options = options_for("short_drive.lcm", 0);
  LoggedDrive(2, errors, false, {}, 0.5, {0.1, false}).write(options.input);
  const auto report = calibrate_log(options);
  ASSERT_TRUE(report.ok()) << report.error().message;
  const Measured& offset = report->motion[MotionParameter::time_offset];
  expect_within(offset, 0, "odometry's offset");
  EXPECT_LT(offset.sigma, 0.005);
  std::filesystem::remove(options.input);
}

/// Odometry whose steps are replaced from `from` s on.
Fault with_steps(double from, std::function<Twist2(double t, Twist2)> replaced) {
  struct State {
    Pose2 last, now;
    bool begun = false;
  };
  const auto state = std::make_shared<State>();
  return {[=](double t, Odometry& odometry) {
            const Pose2 pose = planar(odometry.T_odom_base);
            if (!state->begun) state->last = state->now = pose, state->begun = true;
            const Twist2 step = twist_to(state->last.inverse() * pose);
            state->now = state->now * moved(t < from ? step : replaced(t, step), 1);
            state->last = pose;
            odometry.T_odom_base = transform<Odom, Base>(state->now);
          },
          [](double, Scan&) {}};
}

Fault laser_upside_down() {
  return {[](double, Odometry&) {},
          [](double, Scan& scan) {
            std::reverse(scan.ranges.begin(), scan.ranges.end());
            scan.angle_min =
                -(scan.angle_min + static_cast<float>(scan.ranges.size() - 1) * scan.angle_increment);
          }};
}

Fault laser_frozen(double from) {
  const auto last = std::make_shared<std::vector<float>>();
  return {[](double, Odometry&) {},
          [=](double t, Scan& scan) {
            if (t < from) *last = scan.ranges;
            scan.ranges = *last;
          }};
}

Fault stamps_jumped(double from) {
  return {[from](double t, Odometry& odometry) {
            if (t >= from) odometry.stamp = odometry.stamp + seconds(3.0);
          },
          [](double, Scan&) {}};
}

Twist2 doubled(double, Twist2 step) { return {2 * step.vx, 2 * step.vy, 2 * step.wz}; }
Twist2 slipping(double t, Twist2 step) { return std::fmod(t, 10) < 4 ? Twist2{0.03, 0, 0} : step; }

Result<CalibrationReport> calibrated(const Fault& fault, const test::DriveErrors& errors = {}) {
  const CalibrationOptions options = options_for("faulty.lcm", 0.3);
  LoggedDrive(3, errors, false, fault, 1).write(options.input);
  auto report = calibrate_log(options);
  std::filesystem::remove(options.input);
  return report;
}

TEST(CalibrationLog, RefusesADriveWithAFaultAndNamesIt) {
  struct Case {
    const char* what;
    Fault fault;
    std::vector<const char*> named;  ///< one of them
  };
  const Case cases[] = {
      {"rotation flipped",
       with_steps(0,
                  [](double, Twist2 s) {
                    return Twist2{s.vx, s.vy, -s.wz};
                  }),
       {"turns the wrong way"}},
      {"translation flipped",
       with_steps(0,
                  [](double, Twist2 s) {
                    return Twist2{-s.vx, -s.vy, s.wz};
                  }),
       {"change the sign of odometry's translation"}},
      {"frozen", with_steps(0, [](double, Twist2) { return Twist2{}; }), {"stands still while the robot"}},
      {"doubled", with_steps(20, doubled), {"scale changes"}},
      {"slipping", with_steps(10, slipping), {"slip", "contradicts", "carried", "stands still"}},
      {"laser upside down", laser_upside_down(), {"upside down"}},
      {"laser frozen", laser_frozen(15), {"repeats one scan"}},
      {"stamps jumped", stamps_jumped(15), {"not on the clock"}},
  };
  for (const Case& each : cases) {
    SCOPED_TRACE(each.what);
    const auto report = calibrated(each.fault);
    if (!report.ok()) {
      EXPECT_TRUE(std::any_of(each.named.begin(), each.named.end(), [&](const char* text) {
        return report.error().message.find(text) != std::string::npos;
      })) << report.error().message;
      continue;
    }
    EXPECT_EQ(report->verdict, CalibrationVerdict::refused);
    std::string all;
    for (const std::string& refusal : report->refusals) all += refusal + "\n";
    EXPECT_TRUE(std::any_of(each.named.begin(), each.named.end(), [&](const char* text) {
      return all.find(text) != std::string::npos;
    })) << all;
    const std::string text = to_text(*report, {});
    EXPECT_EQ(text.find("not shown by this drive: "), std::string::npos)
        << "advice for another drive: " << text;
    EXPECT_NE(to_json(*report, {}).find("\"verdict\": \"refused\""), std::string::npos);
  }
}

TEST(CalibrationLog, AcceptsADriveWhoseWheelsSlipOnceInItsValidationPart) {
  test::DriveErrors errors;
  errors.slip = 0;
  const auto report = calibrated(
      with_steps(0, [](double t, Twist2 step) { return t > 47 && t < 47.3 ? Twist2{} : step; }), errors);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_GT(report->check_after.combined_rms(), 5 * report->check_fitted.combined_rms()) << "it slips";
  EXPECT_NE(report->verdict, CalibrationVerdict::refused)
      << (report->refusals.empty() ? "" : report->refusals.front());
}

std::string error_of(const Fault& fault, const CalibrationOptions& options) {
  LoggedDrive(5, {}, false, fault, 0.5).write(options.input);
  const auto report = calibrate_log(options);
  std::filesystem::remove(options.input);
  return report.ok() ? "no error" : report.error().message;
}

/// Without a return from `from` s on.
Fault without_returns(double from) {
  return {[](double, Odometry&) {},
          [from](double t, Scan& scan) {
            if (t < from) return;
            std::fill(scan.ranges.begin(), scan.ranges.end(), std::numeric_limits<float>::infinity());
          }};
}

TEST(CalibrationLog, NamesTheReasonWhereADriveShowsNothing) {
  CalibrationOptions options = options_for("nothing.lcm", 0.3);
  Fault stands = laser_frozen(0.1);
  stands.of_odometry = with_steps(0, [](double, Twist2) { return Twist2{}; }).of_odometry;
  const auto expect = [](const std::string& error, const char* text) {
    EXPECT_NE(error.find(text), std::string::npos) << error;
  };
  expect(error_of(stands, options), "the robot stands: odometry drives 0.00 m");
  expect(error_of(laser_frozen(0.1), options), "but the scans stand still");
  expect(error_of(without_returns(0), options), "0 % of their beams have a return");
  options.imu_channel = "NOPE";
  expect(error_of({}, options), "NOPE");
  options.imu_channel = "IMU";
  options.camera_channel = "CAMERA_9";
  expect(error_of({}, options), "CAMERA_9");
}

TEST(CalibrationLog, NamesTheReasonWhereNoMessageCanBeRead) {
  CalibrationOptions options = options_for("beyond_2200.lcm", 0.25);
  Fault beyond_2200;
  beyond_2200.of_scans = [](double, Scan& scan) {
    scan.stamp = SensorTime::from_utime(8'000'000'000'000'000);
  };
  LoggedDrive(5, {}, false, beyond_2200, 1).write(options.input);
  const auto report = calibrate_log(options);
  ASSERT_FALSE(report.ok());
  EXPECT_NE(report.error().message.find("expected microseconds since 1970"), std::string::npos)
      << report.error().message;
  std::filesystem::remove(options.input);
}

TEST(CalibrationLog, NamesAMapOfAnotherPlace) {
  pose::GridMap map;
  map.width = map.height = 60;  // a cell of 3 m
  map.occupied.assign(3600, 0.1F);
  for (int i = 0; i < 60; ++i) {
    for (const int at : {i, 59 * 60 + i, 60 * i, 60 * i + 59})
      map.occupied[static_cast<std::size_t>(at)] = 0.9F;
  }
  const std::string prefix = (std::filesystem::path(testing::TempDir()) / "another_place").string();
  ASSERT_TRUE(save_ros_map(map, prefix).ok());
  CalibrationOptions options = options_for("elsewhere.lcm", 0.3);
  options.map = prefix + ".yaml";
  const std::string error = error_of({}, options);
  EXPECT_NE(error.find("is it the map of this place?"), std::string::npos) << error;
}

TEST(CalibrationLog, CountsWhatItCannotReadAndNamesALogThatIsCutOff) {
  const CalibrationOptions options = options_for("damaged.lcm", 0.3);
  Fault fault;
  fault.of_odometry = [count = 0](double, Odometry& odometry) mutable {
    if (++count % 20 == 0) odometry.T_odom_base = transform<Odom, Base>(Pose2{1e38, 0, 0});
  };
  LoggedDrive(6, {}, false, fault, 1).write(options.input);
  std::filesystem::resize_file(options.input, std::filesystem::file_size(options.input) - 7);
  const auto report = calibrate_log(options);
  std::filesystem::remove(options.input);
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_EQ(report->findings.size(), 2U);
  EXPECT_NE(report->findings[0].find(" times)"), std::string::npos) << report->findings[0];
  EXPECT_NE(report->findings[1].find("the file ends within an event"), std::string::npos);
  EXPECT_GT(report->refused, 30U);
}

TEST(CalibrationLog, AcceptsALaserThatLooksBackwardWithAWarning) {
  test::DriveErrors errors;
  errors.T_base_laser = {-0.2, 0.02, std::numbers::pi - 0.03};
  const auto report = calibrated({}, errors);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->verdict, CalibrationVerdict::better);
  ASSERT_FALSE(report->warnings.empty());
  EXPECT_NE(report->warnings.back().find("yaw changes by"), std::string::npos) << report->warnings.back();
}

TEST(CalibrateCommand, WritesNoDescriptionThatIsRefused) {
  const test::TemporaryFolder folder;
  const auto path = [&folder](const char* name) { return folder / name; };
  LoggedDrive(3, {}, false, with_steps(0, [](double, Twist2) { return Twist2{}; }), 1)
      .write(path("frozen.lcm"));
  const std::vector<std::string> arguments{"calibrate",        path("frozen.lcm"), "-o",
                                           path("robot.yaml"), "--summary",        path("summary.json")};
  const test::Ran ran = test::run(arguments, path("output.txt"));
  EXPECT_EQ(ran.exit, 1);
  EXPECT_NE(ran.output.find("do not use this result"), std::string::npos) << ran.output;
  EXPECT_NE(ran.output.find("is not written"), std::string::npos) << ran.output;
  EXPECT_FALSE(std::filesystem::exists(path("robot.yaml")));
  EXPECT_TRUE(std::filesystem::exists(path("summary.json")));
  std::vector<std::string> nevertheless = arguments;
  nevertheless.insert(nevertheless.end(), {"--force", "--write-refused"});
  EXPECT_EQ(test::run(nevertheless, path("output.txt")).exit, 1);
  EXPECT_TRUE(std::filesystem::exists(path("robot.yaml")));
}

TEST(CalibrationLog, TakesADescriptionThatIsRightForAsGood) {
  test::DriveErrors errors;
  errors.odometry = {};
  errors.T_base_laser = planar(test::robot_with_laser().laser->T_base_laser);
  const auto report = calibrated({}, errors);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->verdict, CalibrationVerdict::as_good) << to_text(*report, {});
}

/// 60 windows with this error, m, and little scatter.
pose::MotionCheck check_with(double error) {
  pose::MotionCheck check;
  for (int i = 0; i < 60; ++i)
    check.errors.push_back({SensorTime{} + seconds(1000.0 + i), error * (1 + 0.01 * (i % 7)), 0, 1, 1});
  check.windows = check.errors.size();
  check.position_rms = 1.03 * error;
  check.moved_rms = check.turned_rms = 1;
  return check;
}

TEST(CalibrationVerdict, DoesNotTakeTheNoiseOfADriveForAWorseResult) {
  CalibrationReport report;
  report.check_before = check_with(0.0033);
  report.check_after = check_with(0.0051);
  report.check_fitted = check_with(0.005);
  judge({}, report);
  EXPECT_EQ(report.verdict, CalibrationVerdict::as_good);
  report.check_fitted = check_with(0.002);
  judge({}, report);
  EXPECT_EQ(report.verdict, CalibrationVerdict::refused);
}

/// The laser moves by `y`, m; the validation part's errors are multiplied by `factor`.
CalibrationReport moved_laser(double y, double factor) {
  CalibrationReport report;
  report.before.laser = LaserDescription{};
  pose::MotionParameters parameters = pose::motion_parameters(report.before);
  parameters.T_base_laser.y += y;
  report.after = pose::with_motion_parameters(report.before, parameters);
  report.motion.parameters = parameters;
  report.check_before = check_with(0.02);
  report.check_after = report.check_fitted = check_with(0.02 * factor);
  judge({}, report);
  return report;
}

TEST(CalibrationVerdict, WarnsOfALaserThatMovesFarWhereNothingShowsThatItIsBetter) {
  const auto warned = [](const CalibrationReport& report) {
    return !report.warnings.empty() &&
           report.warnings[0].find("the laser's place changes by 90 mm") != std::string::npos;
  };
  const CalibrationReport as_good = moved_laser(0.09, 1), better = moved_laser(0.09, 0.2);
  EXPECT_EQ(as_good.verdict, CalibrationVerdict::as_good);
  EXPECT_TRUE(warned(as_good));
  EXPECT_EQ(better.verdict, CalibrationVerdict::better);
  EXPECT_FALSE(warned(better));
  EXPECT_TRUE(moved_laser(0.02, 1).warnings.empty());
}

TEST(CalibrationLog, SeparatesAnUncheckedResultFromARefusedOne) {
  CalibrationOptions options = options_for("unchecked.lcm", 0);
  LoggedDrive(4, {}, false, {}, 1).write(options.input);
  const auto unchecked = calibrate_log(options);
  ASSERT_TRUE(unchecked.ok()) << unchecked.error().message;
  EXPECT_EQ(unchecked->verdict, CalibrationVerdict::not_checked);
  const std::string json = to_json(*unchecked, options);
  EXPECT_NE(json.find("\"holds\": null"), std::string::npos) << json;
  EXPECT_NE(json.find("\"validation\": null"), std::string::npos) << json;
  options.validation_fraction = 0.02;
  const auto too_short = calibrate_log(options);
  ASSERT_TRUE(too_short.ok()) << too_short.error().message;
  EXPECT_EQ(too_short->verdict, CalibrationVerdict::refused);
  ASSERT_EQ(too_short->refusals.size(), 1U);
  EXPECT_NE(too_short->refusals[0].find("validation part is too short"), std::string::npos);
  std::filesystem::remove(options.input);
}

}  // namespace
}  // namespace parhelion::tools
