// A session whose robot is simulated, in the synthetic room.
#pragma once

#include "tests/server/tick/synthetic.hpp"

namespace parhelion::test {

/// The rover at (-2, 0), heading along x, in addition to `scenario`.
inline tick::Configuration level_1(std::vector<AgentDefinition> agents = {}, Scenario scenario = {},
                                   const SemanticModel& model = room()) {
  scenario.name = "practice";
  scenario.level = 1;
  scenario.agents = std::move(agents);
  scenario.trainee.emplace();
  scenario.trainee->model = "rover";
  scenario.trainee->T_map_base = Transform<Map, Base>::planar(-2, 0, 0);
  auto rover = simulation::load_robot_model("rover");
  EXPECT_TRUE(rover) << rover.error().message;
  auto made = tick::configure(scenario, {}, model,
                              {std::make_shared<const simulation::RobotModel>(std::move(*rover))});
  EXPECT_TRUE(made) << made.error().message;
  return *made;
}

}  // namespace parhelion::test
