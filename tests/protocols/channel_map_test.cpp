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

}  // namespace
}  // namespace parhelion
