#include "protocols/zone.hpp"

#include <gtest/gtest.h>

#include "protocols/scenario.hpp"

namespace parhelion {
namespace {

const std::string kScenario =
    "name: zones\nzones:\n"
    "  - {name: corner, outline: [[0 m, 0 m], [2 m, 0 m], [2 m, 2 m], [1 m, 1 m], [0 m, 2 m]], top: 1.5 m}\n"
    "  - {name: gate, box: {center: [5 m, 1 m], size: [2 m, 1 m], yaw: 90 deg}, bottom: 0 m}\n";

TEST(Zone, AnOutlineMayBeConcave) {
  const auto scenario = parse_scenario(kScenario, "scenario.yaml");
  ASSERT_TRUE(scenario.ok()) << scenario.error().message;
  const Zone& zone = scenario->zones.at(0);
  EXPECT_TRUE(inside(zone, {0.2, 1.5, 0}, 0));
  EXPECT_FALSE(inside(zone, {1, 1.5, 0}, 0)) << "in the notch";
  EXPECT_TRUE(inside(zone, {1, 1.05, 0}, 0.05));
  EXPECT_FALSE(inside(zone, {0.2, 1.5, 1.6}, 0)) << "above";
}

TEST(Zone, ABoxIsTurnedAboutItsCenter) {
  const auto scenario = parse_scenario(kScenario, "scenario.yaml");
  ASSERT_TRUE(scenario.ok());
  EXPECT_TRUE(inside(scenario->zones.at(1), {5.4, 1.9, 0.5}, 0));
  EXPECT_FALSE(inside(scenario->zones.at(1), {5.9, 1.4, 0.5}, 0));
}

TEST(Zone, IsWrittenAsItIsRead) {
  const auto scenario = parse_scenario(kScenario, "scenario.yaml");
  ASSERT_TRUE(scenario.ok());
  const auto again = parse_scenario(to_yaml(*scenario), "again");
  ASSERT_TRUE(again.ok()) << again.error().message;
  ASSERT_EQ(again->zones.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(again->zones[i].outline, scenario->zones[i].outline);
    EXPECT_EQ(again->zones[i].bottom, scenario->zones[i].bottom);
    EXPECT_EQ(again->zones[i].top, scenario->zones[i].top);
  }
}

TEST(Zone, InvalidValuesAreRefusedWithTheirLine) {
  const auto fault = [](const std::string& zones) {
    const auto scenario = parse_scenario("zones:\n" + zones, "s.yaml");
    return scenario ? std::string() : scenario.error().message;
  };
  EXPECT_NE(fault("  - {name: a}\n").find("s.yaml:2"), std::string::npos);
  EXPECT_NE(fault("  - {name: a, outline: [[0 m, 0 m], [1 m, 1 m], [1 m, 0 m], [0 m, 1 m]]}\n").find("cross"),
            std::string::npos);
  EXPECT_NE(fault("  - {name: a, outline: [[0 m, 0 m], [1 m, 0 m], [2 m, 0 m]]}\n").find("area"),
            std::string::npos);
  const std::string square = "box: {center: [0 m, 0 m], size: [1 m, 1 m]}";
  EXPECT_NE(fault("  - {name: a, " + square + "}\n  - {name: a, " + square + "}\n").find("s.yaml:3"),
            std::string::npos);
  EXPECT_NE(fault("  - {name: a, " + square + ", bottom: 2 m, top: 1 m}\n").find("bottom < top"),
            std::string::npos);
}

}  // namespace
}  // namespace parhelion
