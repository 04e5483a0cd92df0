#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "tests/temporary_folder.hpp"
#include "tests/tools/written_bag.hpp"

namespace parhelion::tools {
namespace {

using test::ImportedLog;
using test::RosBytes;
using test::TemporaryFolder;
using test::WrittenBag;

RosBytes transform(const std::string& parent, const std::string& child, std::initializer_list<double> pose) {
  RosBytes bytes;
  bytes.add(std::uint32_t{1}).header(100, 0, parent).text(child).doubles(pose);
  return bytes;
}

RosBytes scan(float time_increment, std::uint32_t seconds = 100, const std::string& frame = "laser") {
  RosBytes bytes;
  bytes.header(seconds, 1000, frame);
  for (const float value : {-1.0F, 1.0F, 0.5F, time_increment, 0.1F, 0.2F, 30.0F}) bytes.add(value);
  bytes.array<float>({1, 2, 3, 4, 5}).array<float>({10, 20, 30, 40, 50});
  return bytes;
}

RosBytes camera_info(double fx, const std::string& model) {
  RosBytes bytes;
  bytes.header(100, 0, "camera_optical").add(std::uint32_t{4}).add(std::uint32_t{6}).text(model);
  bytes.array<double>({0.1, -0.2, 0.003, 0.004, 0.05});
  bytes.doubles({fx, 0, 3.25, 0, 501, 1.75, 0, 0, 1}).doubles({1, 0, 0, 0, 1, 0, 0, 0, 1});
  bytes.doubles({490, 0, 3, 0, 0, 491, 2, 0, 0, 0, 1, 0});
  for (int i = 0; i < 6; ++i) bytes.add(std::uint32_t{0});
  bytes.add(std::uint8_t{0});
  return bytes;
}

RosBytes image(const std::string& encoding, std::uint32_t step, const std::vector<std::uint8_t>& pixels) {
  RosBytes bytes;
  bytes.header(100, 2000, "camera_optical").add(std::uint32_t{4}).add(std::uint32_t{6}).text(encoding);
  bytes.add(std::uint8_t{0}).add(step).array(pixels);
  return bytes;
}

/// x forward of the body is z of the optical frame.
constexpr std::initializer_list<double> kCameraPose = {0.3, 0.1, 1.2, -0.5, 0.5, -0.5, 0.5};

WrittenBag bag_with_camera() {
  WrittenBag bag;
  bag.add("/tf_static", "tf2_msgs/TFMessage", 100, transform("base_link", "camera_optical", kCameraPose));
  bag.add("/tf_static", "tf2_msgs/TFMessage", 100,
          transform("/base_link", "laser", {0.2, 0, 0.4, 0, 0, 1, 0}));
  bag.add("/camera/camera_info", "sensor_msgs/CameraInfo", 100, camera_info(500, "plumb_bob"));
  // Rows of 6 pixels and 2 bytes of padding.
  std::vector<std::uint8_t> pixels(4 * 20);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint8_t>(i);
  bag.add("/camera/image_raw", "sensor_msgs/Image", 100, image("bgr8", 20, pixels));
  return bag;
}

TEST(ImportRosbagCamera, CameraInfoAndStaticTransformBecomeTheDescription) {
  TemporaryFolder folder;
  bag_with_camera().write(folder / "camera.bag");
  const auto report =
      import_recording(test::import_options(folder / "camera.bag", folder / "camera.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  const ImportedLog log(folder / "camera.lcm");
  const RobotDescription robot = log.robot();
  ASSERT_TRUE(robot.camera.has_value());
  EXPECT_EQ(robot.camera->intrinsics.width, 6);
  EXPECT_EQ(robot.camera->intrinsics.height, 4);
  EXPECT_DOUBLE_EQ(robot.camera->intrinsics.fx, 500);
  EXPECT_DOUBLE_EQ(robot.camera->intrinsics.fy, 501);
  EXPECT_DOUBLE_EQ(robot.camera->intrinsics.cx, 3.25);
  EXPECT_DOUBLE_EQ(robot.camera->intrinsics.cy, 1.75);
  EXPECT_THAT(robot.camera->intrinsics.distortion, ::testing::ElementsAre(0.1, -0.2, 0.003, 0.004, 0.05));
  EXPECT_TRUE(robot.camera->T_base_optical.translation().isApprox(Eigen::Vector3d(0.3, 0.1, 1.2), 1e-9));
  EXPECT_TRUE(robot.camera->T_base_optical.rotation().col(2).isApprox(Eigen::Vector3d::UnitX(), 1e-9));
  EXPECT_THAT(robot.camera->source, ::testing::HasSubstr("P [490 0 3 0 0 491 2 0 0 0 1 0]"));
  EXPECT_THAT(robot.source, ::testing::HasSubstr("tf base_link -> laser"));
  const Image image = log.all<Image>(channel::kCamera).at(0);
  EXPECT_EQ(image.row_stride, 18);
  EXPECT_EQ(image.bytes.at(18), 20) << "the padding between rows is gone";
  EXPECT_EQ(image.stamp.ns, 100'000'002'000);
}

TEST(ImportRosbagCamera, ReportsACameraWithoutCalibrationAndInventsNone) {
  TemporaryFolder folder;
  WrittenBag bag;
  bag.add("/tf_static", "tf2_msgs/TFMessage", 100, transform("base_link", "camera_optical", kCameraPose));
  bag.add("/camera/camera_info", "sensor_msgs/CameraInfo", 100, camera_info(0, "plumb_bob"));
  bag.add("/camera/image_raw", "sensor_msgs/Image", 100, image("bgr8", 18, std::vector<std::uint8_t>(72)));
  bag.write(folder / "bare.bag");
  const auto report = import_recording(test::import_options(folder / "bare.bag", folder / "bare.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->find(channel::kCamera)->kept, 1U);
  EXPECT_FALSE(ImportedLog(folder / "bare.lcm").robot().camera.has_value());
  EXPECT_THAT(report->notes, ::testing::Contains(::testing::HasSubstr("without calibration")));
}

TEST(ImportRosbagCamera, AScanTopicWithoutAReadableScanIsRefusedMessageByMessage) {
  TemporaryFolder folder;
  WrittenBag bag = bag_with_camera();
  bag.add("/scan", "sensor_msgs/LaserScan", 101, RosBytes().raw("no scan"));
  bag.write(folder / "broken.bag");
  const auto report =
      import_recording(test::import_options(folder / "broken.bag", folder / "broken.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->refused, 1U);
  EXPECT_THAT(report->notes, ::testing::Contains(::testing::HasSubstr("/scan: no readable scan")));
  EXPECT_FALSE(ImportedLog(folder / "broken.lcm").robot().laser.has_value());
}

/// A recording of 3D lasers only, of both ROS, and one beside a scan: the user reads what to do.
TEST(ImportRosbagCamera, CloudsAreRefusedWithWhatToDo) {
  TemporaryFolder folder;
  WrittenBag bag;
  RosBytes nothing;
  nothing.header(100, 0, "velodyne");
  bag.add("/points", "sensor_msgs/PointCloud2", 100, nothing);
  bag.add("/packets", "velodyne_msgs/VelodyneScan", 100, nothing);
  bag.write(folder / "clouds.bag");
  bag.write_database(folder / "clouds.db3");
  for (const char* name : {"clouds.bag", "clouds.db3"}) {
    const auto refused = import_recording(test::import_options(folder / name, folder / "clouds.lcm"), {});
    ASSERT_FALSE(refused.ok());
    for (const char* part : {"/points (sensor_msgs/PointCloud2)", "/packets, /points: clouds and packets",
                             "pointcloud_to_laserscan", "parhelion map register"})
      EXPECT_THAT(refused.error().message, ::testing::HasSubstr(part));
  }
  bag.add("/scan", "sensor_msgs/LaserScan", 101, scan(0, 101));
  bag.write(folder / "both.bag");
  const auto report = import_recording(test::import_options(folder / "both.bag", folder / "both.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_THAT(report->notes, ::testing::Contains(::testing::HasSubstr("pointcloud_to_laserscan")));
  EXPECT_THAT(report->notes, ::testing::Contains(::testing::StartsWith("no ODOMETRY")));
  EXPECT_THAT(report->notes, ::testing::Not(::testing::Contains(::testing::StartsWith("no SCAN"))));
}

/// Both ROS: the scans of each laser on a channel of its own, and each with its mounting in the description.
TEST(ImportRosbagCamera, AFurtherLaserIsImportedByName) {
  TemporaryFolder folder;
  WrittenBag bag;
  bag.add("/tf_static", "tf2_msgs/TFMessage", 100,
          transform("base_link", "laser", {0.2, 0, 0.3, 0, 0, 0, 1}));
  bag.add("/tf_static", "tf2_msgs/TFMessage", 100,
          transform("base_link", "back", {-0.3, 0, 0.4, 0, 0, 1, 0}));
  for (std::uint32_t second = 101; second < 104; ++second) {
    bag.add("/front/scan", "sensor_msgs/LaserScan", second, scan(0, second));
    bag.add("/back/scan", "sensor_msgs/LaserScan", second, scan(0, second, "back"));
  }
  bag.add("/back/scan", "sensor_msgs/LaserScan", 104, scan(0, 104, "back"));
  bag.write(folder / "two.bag");
  bag.write_database(folder / "two.db3");
  for (const char* name : {"two.bag", "two.db3"}) {
    auto options = test::import_options(folder / name, folder / (std::string(name) + ".lcm"));
    const auto ambiguous = import_recording(options, {});
    ASSERT_FALSE(ambiguous.ok());
    EXPECT_THAT(ambiguous.error().message, ::testing::HasSubstr("SCAN=/back/scan,SCAN_rear=/front/scan"));
    options.topics["SCAN_rear"] = "/back/scan";
    const auto report = import_recording(options, {});
    ASSERT_TRUE(report.ok()) << report.error().message;
    const ImportedLog log(options.output);
    EXPECT_EQ(log.all<Scan>("SCAN").size(), 3U);
    EXPECT_EQ(log.all<Scan>("SCAN_rear").size(), 4U);
    const RobotDescription robot = log.robot();
    ASSERT_TRUE(robot.laser);
    EXPECT_NEAR(robot.laser->T_base_laser.translation().x(), 0.2, 1e-9);
    ASSERT_EQ(robot.further_lasers.size(), 1U);
    EXPECT_EQ(robot.further_lasers[0].name, "rear");
    EXPECT_NEAR(robot.further_lasers[0].laser.T_base_laser.translation().x(), -0.3, 1e-9);
  }
  auto alone = test::import_options(folder / "two.bag", folder / "alone.lcm");
  alone.topics = {{"SCAN", "none"}, {"SCAN_rear", "/back/scan"}};
  const auto refused = import_recording(alone, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("there is no first laser"));
  alone.topics = {{"SCAN_a b", "/back/scan"}};
  const auto no_name = import_recording(alone, {});
  ASSERT_FALSE(no_name.ok());
  EXPECT_THAT(no_name.error().message, ::testing::HasSubstr("expected 1 to 16 letters"));
  alone.topics = {{"SCAN", "/front/scan"}, {"SCAN_a", "/back/scan"}, {"SCAN_b", "/back/scan"}};
  const auto twice = import_recording(alone, {});
  ASSERT_FALSE(twice.ok());
  EXPECT_THAT(twice.error().message, ::testing::HasSubstr("SCAN_b=/back/scan: that topic is SCAN_a already"));
}

TEST(ImportRosbagCamera, ARecordingWithoutAScanHasANote) {
  TemporaryFolder folder;
  bag_with_camera().write(folder / "camera.bag");
  const auto report =
      import_recording(test::import_options(folder / "camera.bag", folder / "camera.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_THAT(report->notes, ::testing::Contains(::testing::StartsWith("no SCAN")));
}

TEST(ImportRecording, AnLcmLogAndAPacketCaptureAreRefusedWithWhatToDo) {
  TemporaryFolder folder;
  const auto refusal = [&](const std::string& name) {
    const auto report = import_recording(test::import_options(folder / name, folder / "out.lcm"), {});
    return report.ok() ? std::string("accepted") : report.error().message;
  };
  test::write_text(folder / "drive.lcm", std::string("\xED\xA1\xDA\x01\0\0\0\0", 8) + std::string(64, '\0'));
  EXPECT_THAT(refusal("drive.lcm"), ::testing::HasSubstr("an LCM log already"));
  test::write_text(folder / "lidar.pcap",
                   std::string("\xD4\xC3\xB2\xA1\x02\0\x04\0", 8) + std::string(64, '\0'));
  test::write_text(folder / "lidar.pcapng",
                   std::string("\x0A\x0D\x0D\x0A\x1C\0\0\0", 8) + std::string(64, '\0'));
  EXPECT_THAT(refusal("lidar.pcap"), ::testing::HasSubstr("packet capture"));
  EXPECT_THAT(refusal("lidar.pcapng"), ::testing::HasSubstr("packet capture"));
}

TEST(ImportRosbagCamera, DepthIsConvertedToMillimetresAndKeepsHoles) {
  TemporaryFolder folder;
  WrittenBag bag = bag_with_camera();
  std::vector<float> metres(24, 1.2345F);
  metres[0] = std::numeric_limits<float>::quiet_NaN();
  metres[1] = std::numeric_limits<float>::infinity();
  std::vector<std::uint8_t> pixels(96);
  std::memcpy(pixels.data(), metres.data(), pixels.size());
  bag.add("/depth/image", "sensor_msgs/Image", 101, image("32FC1", 24, pixels));
  bag.write(folder / "depth.bag");
  const auto report = import_recording(test::import_options(folder / "depth.bag", folder / "depth.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  const Image depth = ImportedLog(folder / "depth.lcm").all<Image>(channel::kDepth).at(0);
  const cv::Mat mm = cv::imdecode(depth.bytes, cv::IMREAD_UNCHANGED);
  EXPECT_EQ(mm.at<std::uint16_t>(0, 0), 0);
  EXPECT_EQ(mm.at<std::uint16_t>(0, 1), 0);
  EXPECT_NEAR(mm.at<std::uint16_t>(2, 3), 1234.5, 0.6);
}

TEST(ImportRosbagCamera, AnOldStampOfStaticTransformsDoesNotSetTheStart) {
  TemporaryFolder folder;
  WrittenBag bag;
  const std::uint32_t start = 50'000;  // s; the static transforms are of second 100
  for (int i = 0; i < 30; ++i) {
    bag.add("/tf_static", "tf2_msgs/TFMessage", start,
            transform("base_link", "sensor_" + std::to_string(i), {0.2, 0, 0.4, 0, 0, 0, 1}));
  }
  bag.add("/scan", "sensor_msgs/LaserScan", start, scan(0.01F, start));
  bag.write(folder / "latched.bag");
  const auto report =
      import_recording(test::import_options(folder / "latched.bag", folder / "latched.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  const ImportedLog log(folder / "latched.lcm");
  ASSERT_EQ(log.events.size(), 2U);
  EXPECT_EQ(log.events.front().channel, channel::kRobot);
  EXPECT_NEAR(static_cast<double>(log.events.front().arrival.ns) * 1e-9, start, 1);
}

TEST(ImportRosbagCamera, ScanIsOrderedByTime) {
  for (const float time_increment : {0.01F, -0.01F}) {
    TemporaryFolder folder;
    WrittenBag bag;
    bag.add("/tf_static", "tf2_msgs/TFMessage", 100,
            transform("base_link", "laser", {0.2, 0, 0.4, 0, 0, 0, 1}));
    bag.add("/scan", "sensor_msgs/LaserScan", 100, scan(time_increment));
    bag.write(folder / "scan.bag");
    const auto report = import_recording(test::import_options(folder / "scan.bag", folder / "scan.lcm"), {});
    ASSERT_TRUE(report.ok()) << report.error().message;
    const ImportedLog log(folder / "scan.lcm");
    const Scan imported = log.all<Scan>(channel::kScan).at(0);
    const LaserDescription laser = *log.robot().laser;
    EXPECT_NEAR(laser.beam_interval, 0.01, 1e-8);
    EXPECT_NEAR(laser.scan_period, 0.1, 1e-8);
    EXPECT_FLOAT_EQ(laser.convention.range_min, 0.2F);
    // Range 1 was measured at -1 rad, at the stamp; range 2 at -0.5 rad and time_increment after it.
    for (std::size_t i = 0; i < 5; ++i) {
      const float value = imported.ranges[i];
      const double angle = imported.angle_min + static_cast<double>(i) * imported.angle_increment;
      EXPECT_NEAR(angle, -1 + 0.5 * (value - 1), 1e-6);
      EXPECT_NEAR(laser.beam_time(i, 5).seconds(), static_cast<double>(time_increment) * (value - 1), 1e-7);
      EXPECT_EQ(imported.intensities[i], 10 * value);
    }
  }
}

RosBytes imu(std::uint32_t ns, double orientation_covariance) {
  RosBytes bytes;
  bytes.header(100, ns, "imu_link").doubles({0, 0.6, 0, 0.8});
  for (int i = 0; i < 9; ++i) bytes.add(i == 0 ? orientation_covariance : 0.0);
  bytes.doubles({0.1, 0.2, 0.3}).doubles({0, 0, 0, 0, 0, 0, 0, 0, 0});
  bytes.doubles({1, 2, 9.5}).doubles({0, 0, 0, 0, 0, 0, 0, 0, 0});
  return bytes;
}

RosBytes joint_state(std::uint32_t ns, double position) {
  RosBytes bytes;
  bytes.header(100, ns, "").add(std::uint32_t{2}).text("pan").text("tilt");
  bytes.array<double>({position, 0.25}).array<double>({}).array<double>({1, 2});
  return bytes;
}

TEST(ImportRosbag, ImuMountingAndJointsAreKept) {
  TemporaryFolder folder;
  WrittenBag bag = bag_with_camera();
  bag.add("/tf_static", "tf2_msgs/TFMessage", 100,
          transform("base_link", "imu_link", {0.1, 0, 0.2, 0, 0, 0.6, 0.8}));
  bag.add("/imu", "sensor_msgs/Imu", 100, imu(3000, 0.01));
  bag.add("/imu", "sensor_msgs/Imu", 100, imu(5000, -1));
  bag.add("/joint_states", "sensor_msgs/JointState", 100, joint_state(4000, 0.5));
  bag.add("/joint_states", "sensor_msgs/JointState", 100, joint_state(6000, std::nan("")));
  bag.write(folder / "a.bag");
  const auto report = import_recording(test::import_options(folder / "a.bag", folder / "a.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->refused, 1U) << "a position that is no number";
  const ImportedLog log(folder / "a.lcm");
  const auto samples = log.all<ImuSample>(channel::kImu);
  ASSERT_EQ(samples.size(), 2U);
  ASSERT_TRUE(samples[0].orientation);
  EXPECT_NEAR(samples[0].orientation->angularDistance(Eigen::Quaterniond(0.8, 0, 0.6, 0)), 0, 1e-7);
  EXPECT_EQ(samples[0].rotation_rate, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(samples[0].acceleration, Eigen::Vector3d(1, 2, 9.5));
  EXPECT_FALSE(samples[1].orientation) << "ROS says so by a covariance of -1";
  const auto joints = log.all<Joints>(channel::kJointState);
  ASSERT_EQ(joints.size(), 1U);
  EXPECT_EQ(joints[0].names, (std::vector<std::string>{"pan", "tilt"}));
  EXPECT_EQ(joints[0].positions, (std::vector<double>{0.5, 0.25}));
  EXPECT_TRUE(joints[0].velocities.empty());
  ASSERT_TRUE(log.robot().imu);
  EXPECT_TRUE(log.robot().imu->T_base_imu.isometry().isApprox(
      Transform<Base, Imu>(Eigen::Quaterniond(0.8, 0, 0, 0.6), {0.1, 0, 0.2}).isometry(), 1e-9));
}

}  // namespace
}  // namespace parhelion::tools
