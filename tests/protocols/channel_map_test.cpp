// Names of the channels of several robots: SCAN.rover_2.
#include "protocols/channel_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
// After gtest.h, which it does not include itself.
#include <rapidcheck/gtest.h>

#include "protocols/robot.hpp"

namespace parhelion {
namespace {

using testing::HasSubstr;

std::vector<std::string> canonical_channels() {
  std::vector<std::string> all = input_channels({});
  for (std::string& output : output_channels({})) all.push_back(std::move(output));
  return all;
}

TEST(RobotChannel, AppendsTheRobotNameToTheCanonicalName) {
  EXPECT_EQ(robot_channel("SCAN", "rover_2"), "SCAN.rover_2");
  EXPECT_EQ(robot_channel("MR_SCAN", "rover_2"), "MR_SCAN.rover_2");
  EXPECT_EQ(robot_channel("SCAN", ""), "SCAN") << "there is one robot";
}

TEST(RobotChannel, CanonicalNamesHaveNoSeparatorAndFitTheLongestRobotName) {
  const std::string longest(kMaxRobotName, 'x');
  for (const std::string& canonical : canonical_channels()) {
    EXPECT_EQ(canonical.find(kRobotSeparator), std::string::npos) << canonical;
    EXPECT_EQ(channel_name_fault(robot_channel(canonical, longest)), "") << canonical;
  }
}

RC_GTEST_PROP(RobotChannel, ParsesBackToTheSameParts, ()) {
  const std::string canonical = *rc::gen::elementOf(canonical_channels());
  const auto letter =
      rc::gen::oneOf(rc::gen::inRange('a', '{'), rc::gen::inRange('0', ':'), rc::gen::element('_', '-'));
  std::string robot = *rc::gen::container<std::string>(letter);
  robot.resize(std::min(robot.size(), kMaxRobotName));
  const std::string name = robot_channel(canonical, robot);
  const auto parts = parse_robot_channel(name);
  RC_ASSERT(parts.has_value());
  RC_ASSERT(parts->canonical == canonical && parts->robot == robot);
}

TEST(RobotChannel, InvalidRobotNamesGiveNoChannel) {
  for (const char* name : {"", ".rover", "SCAN.", "SCAN.a.b", "SCAN.a b", "SCAN.rover/2",
                           "SCAN.012345678901234567890123456789012"})
    EXPECT_FALSE(parse_robot_channel(name)) << name;
}

TEST(RobotChannel, ARobotNameThatFitsNoChannelIsRefused) {
  for (const std::string name : {"rover.2", "my robot", "''"}) {
    const auto robot = parse_robot_description("name: " + name + "\n", "r.yaml");
    ASSERT_FALSE(robot) << name;
    EXPECT_THAT(robot.error().message, HasSubstr("r.yaml:1: 'name' of a robot, part of channel names"))
        << name;
  }
  EXPECT_TRUE(parse_robot_description("name: rover_2\n", "r.yaml"));
}

TEST(SensorChannel, AppendsTheNameOfALaserAfterTheFirst) {
  EXPECT_EQ(sensor_channel("SCAN", "rear"), "SCAN_rear");
  EXPECT_EQ(sensor_channel("MR_SCAN_INFO", "rear"), "MR_SCAN_INFO_rear");
  EXPECT_EQ(sensor_channel("SCAN", ""), "SCAN") << "the first laser";
  EXPECT_EQ(robot_channel(sensor_channel("SCAN", "rear"), "rover_2"), "SCAN_rear.rover_2");
}

TEST(SensorChannel, TheLongestNamesFit) {
  const std::string sensor(16, 'x'), robot(kMaxRobotName, 'y');
  ASSERT_EQ(sensor_name_fault(sensor), "");
  for (const char* canonical : laser_channels())
    EXPECT_EQ(channel_name_fault(robot_channel(sensor_channel(canonical, sensor), robot)), "") << canonical;
}

RC_GTEST_PROP(SensorChannel, ParsesBackToTheSameParts, ()) {
  const std::vector<std::string> bare(laser_channels().begin(), laser_channels().end());
  const std::string canonical = *rc::gen::elementOf(bare);
  const auto letter = rc::gen::elementOf(std::string("INFOSCaz09_"));
  const std::string sensor = (*rc::gen::nonEmpty(rc::gen::container<std::string>(letter))).substr(0, 16);
  RC_PRE(sensor_name_fault(sensor).empty());
  const std::string name = sensor_channel(canonical, sensor);
  const SensorChannel parts = parse_sensor_channel(name);
  RC_ASSERT(parts.canonical == canonical && parts.sensor == sensor);
  RC_ASSERT(is_robot_channel(name));
  RC_ASSERT(without_sensor(robot_channel(name, "rover")) == robot_channel(canonical, "rover"));
}

TEST(SensorChannel, OtherNamesHaveNoSensor) {
  std::vector<std::string> names = canonical_channels();
  for (const char* name : {"SCAN_", "SCAN_a-b", "SCAN_INFO", "MR_SCAN_INFO_", "SCANNER", "IMU_left",
                           "MR_CAMERA_RATE", "SCAN_12345678901234567"})
    names.emplace_back(name);
  for (const std::string& name : names) {
    EXPECT_EQ(parse_sensor_channel(name).canonical, name);
    EXPECT_EQ(parse_sensor_channel(name).sensor, "") << name;
    EXPECT_EQ(without_sensor(name), name);
  }
}

TEST(SensorChannel, ANameThatMrScanInfoHasTakenIsRefused) {
  EXPECT_THAT(sensor_name_fault("INFO"), HasSubstr("MR_SCAN_INFO"));
  EXPECT_THAT(sensor_name_fault("INFO_rear"), HasSubstr("MR_SCAN_INFO"));
  EXPECT_THAT(sensor_name_fault("RATE"), HasSubstr("MR_CAMERA_RATE"));
  EXPECT_EQ(sensor_name_fault("INFORMER"), "");
}

}  // namespace
}  // namespace parhelion
