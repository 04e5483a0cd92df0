// A cable: it hangs over an edge, is dragged, does not stretch, and comes to rest.
#include "server/simulation/bodies/cable.hpp"

#include "robots_world.hpp"
#include "server/simulation/bodies/bodies.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

AgentDefinition cable(double x, double y, double length) {
  AgentDefinition definition = agent("cable", AgentKind::cable, x, y);
  definition.size = {length, 0.03, 0.03};
  return definition;
}

std::vector<BodyState> links(const Simulation& simulation) {
  std::vector<BodyState> states;
  const std::size_t count = agent_bodies(*simulation.find_agent("cable"), 1).size();
  for (std::size_t i = 0; i < count; ++i)
    states.push_back(body(simulation, "cable", "link_" + std::to_string(i + 1)));
  return states;
}

/// m, largest distance between the ends of neighbouring links.
double gap(const std::vector<BodyState>& states, double pitch) {
  double largest = 0;
  for (std::size_t i = 1; i < states.size(); ++i) {
    const Eigen::Vector3d a = states[i - 1].T_map_body * Eigen::Vector3d(pitch / 2, 0, 0);
    const Eigen::Vector3d b = states[i].T_map_body * Eigen::Vector3d(-pitch / 2, 0, 0);
    largest = std::max(largest, (a - b).norm());
  }
  return largest;
}

TEST(Cable, RestsWhereItIsPlacedAndSleeps) {
  Simulation simulation = make(floor_of(20), {});
  spawn(simulation, cable(0, 0, 1.2));
  run(simulation, 4);
  for (const BodyState& link : links(simulation)) {
    EXPECT_NEAR(link.T_map_body.translation().z(), 0.015, 0.002);
    EXPECT_EQ(link.velocity.norm(), 0);
  }
}

TEST(Cable, SlidesOffAPlatformOnlyWhereMostOfItHangs) {
  for (const double over :
       {0.25, 0.58}) {  // m of 1.2 m over the edge at x = 0; with friction 0.7 it slides from 0.49 m on
    SemanticModel model = floor_of(20);
    model.entities.push_back(model_box("platform", EntityLabel::floor, {-2, 0, 0.75}, {4, 4, 1.5}));
    Simulation simulation = make(model, {});
    spawn(simulation, cable(over - 0.6, 0, 1.2));
    run(simulation, 4);
    const auto states = links(simulation);
    EXPECT_LT(gap(states, 0.06), 0.004) << over;
    if (over < 0.4) {
      EXPECT_NEAR(states.front().T_map_body.translation().z(), 1.515, 0.01);
      const Eigen::Vector3d end = states.back().T_map_body.translation();
      EXPECT_LT(end.z(), 1.45) << "it hangs down";
    } else {
      EXPECT_LT(states.front().T_map_body.translation().z(), 0.1) << "it has slid off";
    }
    for (const BodyState& link : states) EXPECT_LT(link.velocity.norm(), 0.05);
  }
}

TEST(Cable, InvalidSizesAreRefused) {
  Simulation simulation = make(floor_of(20), {});
  AgentDefinition wrong = cable(0, 0, 1.2);
  wrong.size = {0.4, 0.4, 0.6};
  const Status status = simulation.spawn(wrong, std::nullopt);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("twice its diameter"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::simulation
