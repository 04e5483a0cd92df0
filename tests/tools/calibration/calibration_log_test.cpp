// `parhelion calibrate` over a log of a drive whose errors are known.
#include "tools/calibration_log.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "tests/fusion/pose/calibration_drive.hpp"
#include "tests/tools/calibration/textured_room.hpp"

namespace parhelion::tools {
namespace {

using pose::Measured;
using pose::MotionParameter;

constexpr double kImuOffset = 0.035, kImuBias = -0.01, kImuScale = 0.99, kCameraOffset = -0.06;

class LoggedDrive {
 public:
  LoggedDrive(std::uint32_t seed, const test::DriveErrors& errors, bool camera)
      : random_(seed), errors_(errors) {
    robot_ = test::robot_with_laser();  // the drawing
    robot_.imu = ImuDescription{};
    if (camera) robot_.camera = test::level_camera(0);
    RobotDescription real = pose::with_motion_parameters(robot_, {{}, errors_.T_base_laser, {}, 0});
    RobotMessage description;
    description.yaml = to_yaml(robot_);
    put(-1, channel::kRobot, description);
    for (const Odometry& odometry : test::odometry_of(path_, errors_, random_))
      put((odometry.stamp - SensorTime{}).seconds() - 1000, channel::kOdometry, odometry);
    // Each message arrives when it was taken; only stamps differ.
    for (double t = 0.05; t < path_.duration() - 0.1; t += 0.1)
      put(t, channel::kScan, test::swept_scan(path_, real, t, random_));
    add_imu();
    if (camera) add_camera();
  }

  void write(const std::filesystem::path& path) {
    std::stable_sort(messages_.begin(), messages_.end(),
                     [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
    auto writer = LogWriter::create(path.string(), true);
    ASSERT_TRUE(writer.ok());
    ASSERT_TRUE(writer->write(messages_).ok());
  }

 private:
  template <class T>
  void put(double t, const char* channel, const T& item) {
    Message message{channel, ArrivalTime{(SensorTime{} + seconds(1000 + t)).ns}, {}};
    encode(item, message.payload);
    messages_.push_back(std::move(message));
  }

  void add_camera() {
    for (double t = 0.02; t < path_.duration() - 0.02; t += 0.1) {
      const SensorTime stamp = SensorTime{} + seconds(1000 + t - kCameraOffset);
      put(t, channel::kCamera, test::textured_image(*robot_.camera, path_.at(t), stamp, random_));
    }
  }

  void add_imu() {
    std::normal_distribution<double> noise;
    for (double t = 0.01; t < path_.duration() - 0.01; t += 0.01) {
      ImuSample sample;
      sample.stamp = SensorTime{} + seconds(1000 + t - kImuOffset);
      const double rate = wrap_angle(path_.at(t + 0.005).yaw - path_.at(t - 0.005).yaw) / 0.01;
      sample.rotation_rate = {0, 0, rate / kImuScale + kImuBias + 0.01 * noise(random_)};
      put(t, channel::kImu, sample);
    }
  }

  std::mt19937 random_;
  test::DriveErrors errors_;
  test::SampledPath path_ = test::brisk_path(1.5);
  RobotDescription robot_;
  std::vector<Message> messages_;
};

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

}  // namespace
}  // namespace parhelion::tools
