#include "tools/demo/driven_training.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace parhelion::tools {
namespace {

/// A free square of 20 m with walls around it and unknown space beyond `free_x` (m).
pose::GridMap floor_up_to(double free_x) {
  pose::GridMap map;
  map.width = map.height = 400;
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) {
      const bool wall = x == 0 || y == 0 || x == map.width - 1 || y == map.height - 1;
      map.occupied.push_back(wall ? 1.0F : x * map.resolution < free_x ? 0.0F : 0.5F);
    }
  return map;
}

Scenario with_robot_at(double x, double y, double yaw) {
  Scenario scenario;
  AgentDefinition robot;
  robot.name = "robot_1";
  robot.kind = AgentKind::robot;
  robot.T_map_base = Transform<Map, Base>::planar(x, y, yaw);
  scenario.agents = {robot};
  return scenario;
}

TEST(DrivenTraining, TheZoneIsAheadOnFreeFloor) {
  Scenario scenario = with_robot_at(4, 10, 0.3);
  const Status added = add_driven_training(floor_up_to(20), "robot_1", scenario);
  ASSERT_TRUE(added.ok()) << added.error().message;
  const auto& pose = scenario.agents[0].T_map_base;
  EXPECT_NEAR(pose.yaw(), 0.3, 1e-9) << "it may stay as it stands";
  ASSERT_EQ(scenario.zones.size(), 1U);
  EXPECT_TRUE(inside(scenario.zones[0], {4 + 3 * std::cos(0.3), 10 + 3 * std::sin(0.3), 0}, 0));
  EXPECT_FALSE(inside(scenario.zones[0], pose.translation(), 0.3)) << "there is something to drive";
  EXPECT_EQ(scenario.training->robot, "robot_1");
  EXPECT_EQ(scenario.agents[0].behaviour.kind, BehaviourKind::teleop);
}

TEST(DrivenTraining, TheZoneAvoidsWallsAndUnknownSpace) {
  Scenario scenario = with_robot_at(7, 10, 0);
  ASSERT_TRUE(add_driven_training(floor_up_to(8), "robot_1", scenario).ok());
  EXPECT_GT(std::abs(scenario.agents[0].T_map_base.yaw()), 1.2);
}

TEST(DrivenTraining, WithoutFreeSpaceNothingIsChanged) {
  Scenario scenario = with_robot_at(1.2, 1.2, 0);
  pose::GridMap map = floor_up_to(2);
  map.height = 48;  // m 2.4
  map.occupied.resize(static_cast<std::size_t>(map.width) * 48);
  EXPECT_FALSE(add_driven_training(map, "robot_1", scenario).ok());
  EXPECT_FALSE(add_driven_training(map, "robot_2", scenario).ok());
  EXPECT_TRUE(scenario.zones.empty());
  EXPECT_FALSE(scenario.training.has_value());
  EXPECT_EQ(scenario.agents[0].T_map_base.yaw(), 0);
}

}  // namespace
}  // namespace parhelion::tools
