// Faults and ranges of a scenario.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "protocols/scenario.hpp"
#include "tests/protocols/scenario_error.hpp"

namespace parhelion {
namespace {

using testing::HasSubstr;

using test::error_of;

const std::string kRanges = R"(name: r
level: 1
seed: 7
agents:
  - name: person_1
    kind: person
    pose: {x: {from: 1 m, to: 3 m}, y: 2 m}
    behaviour: {kind: wander, speed: {from: 0.3 m/s, to: 0.8 m/s}}
max_agents: {from: 5, to: 7}
)";

TEST(RandomFaultValues, AreDrawnFromTheSeedAndRecordedInTheScenario) {
  const auto scenario = parse_scenario(kRanges, "s.yaml");
  ASSERT_TRUE(scenario.ok()) << scenario.error().message;
  const AgentDefinition& person = scenario->agents[0];
  EXPECT_GE(person.T_map_base.translation().x(), 1);
  EXPECT_LT(person.T_map_base.translation().x(), 3);
  EXPECT_GE(person.behaviour.speed, 0.3);
  EXPECT_LT(person.behaviour.speed, 0.8);
  ASSERT_EQ(scenario->drawn_values.size(), 3U);
  EXPECT_EQ(scenario->drawn_values[0].key, "agents.0.pose.x");
  EXPECT_EQ(scenario->drawn_values[1].key, "agents.0.behaviour.speed");
  EXPECT_EQ(scenario->drawn_values[1].from, "0.3 m/s");
  EXPECT_EQ(scenario->drawn_values[1].to, "0.8 m/s");
  const auto again = parse_scenario(kRanges, "s.yaml");
  EXPECT_EQ(to_yaml(*again), to_yaml(*scenario)) << "the same each time";
}

TEST(RandomFaultValues, DrawnValuesAreSavedExactlyAndNotDrawnAgain) {
  const auto scenario = parse_scenario(kRanges, "s.yaml");
  ASSERT_TRUE(scenario.ok());
  const std::string written = to_yaml(*scenario);
  const auto again = parse_scenario(written, "again.yaml", 99);
  ASSERT_TRUE(again.ok()) << again.error().message << "\n" << written;
  EXPECT_EQ(again->agents[0].behaviour.speed, scenario->agents[0].behaviour.speed);
  EXPECT_EQ(again->agents[0].T_map_base.translation(), scenario->agents[0].T_map_base.translation());
  ASSERT_EQ(again->drawn_values.size(), 3U);
  EXPECT_EQ(again->drawn_values[2].value, scenario->drawn_values[2].value);
}

TEST(RandomFaultValues, SeedsChangeTheValuesAndIntegersReachBothEnds) {
  std::set<double> speeds;
  std::set<std::uint64_t> counts;
  for (std::uint64_t seed = 0; seed < 64; ++seed) {
    const auto scenario = parse_scenario(kRanges, "s.yaml", seed);
    ASSERT_TRUE(scenario.ok());
    EXPECT_EQ(scenario->seed, seed);
    speeds.insert(scenario->agents[0].behaviour.speed);
    counts.insert(scenario->max_agents);
  }
  EXPECT_EQ(speeds.size(), 64U);
  EXPECT_EQ(counts, (std::set<std::uint64_t>{5, 6, 7}));
}

TEST(RandomFaultValues, ARangeElsewhereDoesNotChangeOtherValues) {
  const auto more = parse_scenario(kRanges + "physics_rate: {from: 200 Hz, to: 300 Hz}\n", "s.yaml");
  ASSERT_TRUE(more.ok()) << more.error().message;
  EXPECT_EQ(more->agents[0].behaviour.speed, parse_scenario(kRanges, "s.yaml")->agents[0].behaviour.speed);
}

TEST(RandomFaultValues, InvalidRangesAreReportedWithTheirLine) {
  EXPECT_THAT(error_of("physics_rate: {from: 300 Hz, to: 200 Hz}\n"), HasSubstr("s.yaml:1: 'physics_rate'"));
  EXPECT_THAT(error_of("name: x\nphysics_rate: {from: 300 Hz, to: 1 kHz}\n"), HasSubstr("s.yaml:2"));
  EXPECT_THAT(error_of("physics_rate: {from: fast, to: faster}\n"),
              HasSubstr("expected a range of two numbers"));
  EXPECT_THAT(error_of("physics_rate: {from: 200 Hz, to: 20 MHz}\n"), HasSubstr("s.yaml:1"));
}

TEST(Faults, AreReadAndWrittenBack) {
  const auto scenario = parse_scenario(R"(level: 1
faults:
  - {camera_delay: 200 ms}
  - {camera_loss: 0.1, after: 5 s}
  - {laser_dropouts: {from: 0.05, to: 0.2}, after: 20 s, for: 30 s}
  - {low_battery: 0.15}
  - {dead_wheel: right, after: 1 min}
)",
                                       "s.yaml");
  ASSERT_TRUE(scenario.ok()) << scenario.error().message;
  ASSERT_EQ(scenario->faults.size(), 5U);
  EXPECT_EQ(scenario->faults[0].amount, 0.2);
  EXPECT_EQ(scenario->faults[2].after, 20);
  EXPECT_EQ(scenario->faults[2].lasting, 30);
  EXPECT_TRUE(scenario->faults[2].holds(20));
  EXPECT_FALSE(scenario->faults[2].holds(50));
  EXPECT_TRUE(scenario->faults[4].right);
  const auto again = parse_scenario(to_yaml(*scenario), "again.yaml");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(to_yaml(*again), to_yaml(*scenario));
  EXPECT_EQ(again->faults[2].amount, scenario->faults[2].amount);
}

TEST(Faults, OnlyCameraFaultsApplyToARealRobot) {
  EXPECT_THAT(error_of("level: 3\nfaults:\n  - {laser_dropouts: 0.1}\n"),
              HasSubstr("s.yaml:3: 'laser_dropouts' is a fault of simulated robots: at level 3"));
  EXPECT_THAT(error_of("faults: [{low_battery: 0.1}]\n"), HasSubstr("'low_battery'"));
  EXPECT_THAT(error_of("faults: [{dead_wheel: left}]\n"), HasSubstr("'dead_wheel'"));
  EXPECT_EQ(error_of("level: 3\nfaults: [{camera_delay: 500 ms}, {camera_loss: 0.5}]\n"), "")
      << "these act on a page";
  EXPECT_THAT(error_of("faults: [{camera_delay: 501 ms}]\n"), HasSubstr("s.yaml:1: 'camera_delay'"));
  EXPECT_THAT(error_of("level: 1\nfaults: [{low_battery: 0.2, after: 3 s}]\n"), HasSubstr("'after'"));
  EXPECT_THAT(error_of("level: 1\nfaults: [{dead_wheel: left, camera_loss: 0.1}]\n"), HasSubstr("found two"));
  EXPECT_THAT(error_of("level: 1\nfaults: [{after: 3 s}]\n"), HasSubstr("expected one of camera_delay"));
  EXPECT_THAT(error_of("level: 1\nfaults: [{laser_dropout: 0.1}]\n"),
              HasSubstr("did you mean 'laser_dropouts'"));
}

}  // namespace
}  // namespace parhelion
