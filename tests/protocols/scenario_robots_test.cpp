// 'robots' of a scenario: names, descriptions and channels of several robots.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocols/scenario.hpp"
#include "tests/protocols/scenario_error.hpp"

namespace parhelion {
namespace {

using ::testing::HasSubstr;

using test::error_of;

TEST(ScenarioRobots, AreReadAndWrittenBack) {
  const auto scenario = parse_scenario(R"(name: two
robots:
  - name: rover_1
    description: rover.robot.yaml
    channels: {SCAN: front_laser, MR_CMD: drive}
  - name: rover_2
channels: {SCAN.rover_2: rear_laser, MR_EVENTS: events}
)",
                                       "s.yaml");
  ASSERT_TRUE(scenario) << scenario.error().message;
  const auto again = parse_scenario(to_yaml(*scenario), "again.yaml");
  ASSERT_TRUE(again) << again.error().message;
  for (const Scenario* each : {&*scenario, &*again}) {
    ASSERT_EQ(each->robots.size(), 2U);
    EXPECT_EQ(each->robots[0].name, "rover_1");
    EXPECT_EQ(each->robots[0].description, "rover.robot.yaml");
    EXPECT_EQ(each->robots[1].description, "");
    EXPECT_EQ(each->channels, (std::map<std::string, std::string>{{"SCAN.rover_1", "front_laser"},
                                                                  {"MR_CMD.rover_1", "drive"},
                                                                  {"SCAN.rover_2", "rear_laser"},
                                                                  {"MR_EVENTS", "events"}}));
  }
}

TEST(ScenarioRobots, OneRobotKeepsTheBareNames) {
  const auto scenario = parse_scenario("robots: [{name: rover, channels: {SCAN: laser}}]", "s.yaml");
  ASSERT_TRUE(scenario) << scenario.error().message;
  EXPECT_EQ(scenario->channels, (std::map<std::string, std::string>{{"SCAN", "laser"}}));
  EXPECT_THAT(error_of("robots: [{name: rover}]\nchannels: {SCAN.rover: laser}"),
              HasSubstr("s.yaml:2: unknown channel 'SCAN.rover'"));
}

TEST(ScenarioRobots, MistakesNameTheLine) {
  const std::string two = "robots:\n  - name: a\n  - name: b\n";
  const std::pair<std::string, std::string> mistakes[] = {
      {"robots:\n  - name: a\n  - name: a\n", "s.yaml:3: name 'a' is taken by the robot in line 2"},
      {"robots:\n  - name: a.b\n", "s.yaml:2: 'name' of a robot, part of channel names: expected 1 to 32"},
      {"robots: [{name: a}]\nrobot: r.yaml", "s.yaml:2: 'robot' is for a session of one robot"},
      {two + "agents:\n  - {name: b, kind: box, pose: {x: 1 m, y: 0 m}}",
       "s.yaml:3: name 'b' is taken by an agent"},
      {two + "channels: {SCAN: laser}", "s.yaml:4: unknown channel 'SCAN', did you mean 'SCAN.a'?"},
      {"robots:\n  - {name: a, channels: {SCAM: x}}",
       "s.yaml:2: 'SCAM' is no channel of a robot, did you mean 'SCAN'?"},
      {"robots:\n  - {name: a, channels: {MR_WORLD: x}}", "s.yaml:2: 'MR_WORLD' is no channel of a robot"},
      {"robots:\n  - {name: a, channels: {SCAN: laser}}\n  - {name: b, channels: {SCAN: laser}}",
       "s.yaml:3: 'channels': SCAN.b and SCAN.a would both be named 'laser' on the bus"},
      {"robots:\n  - {name: a}\n  - {name: b, channels: {MR_CMD: TELEOP.a}}",
       "s.yaml:3: 'channels': the output MR_CMD.b and the input TELEOP.a would both be named 'TELEOP.a'"},
      {"robots: []", "robots"},
  };
  for (const auto& [yaml, expected] : mistakes) EXPECT_THAT(error_of(yaml), HasSubstr(expected)) << yaml;
}

}  // namespace
}  // namespace parhelion
