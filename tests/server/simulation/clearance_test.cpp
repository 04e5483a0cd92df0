#include <random>

#include "server/simulation/building/planar.hpp"
#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

/// Reference implementation: the footprint is placed repeatedly along the arc, each time against all agents.
double dense_distance(const std::vector<Footprint>& agents, const Pose2& pose, const Twist2& twist,
                      double limit) {
  const Footprint local = make_polygon(robot().footprint);
  const double speed = fastest_point_speed(local, twist);
  constexpr double spacing = 0.002;
  Footprint placed;
  for (double travel = 0; travel <= limit; travel += spacing) {
    place(local, advance(pose, twist, travel / speed), placed);
    for (const Footprint& agent : agents) {
      if (signed_distance(placed, agent) <= 0) return travel;
    }
  }
  return limit;
}

TEST(Clearance, AgreesWithDenseSamplingAlongRandomArcs) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  int hits = 0;
  for (int world = 0; world < 40; ++world) {
    Simulation simulation = make();
    std::vector<Footprint> footprints;
    for (int i = 0; i < 6; ++i) {
      AgentDefinition definition = agent("a" + std::to_string(i), i % 2 ? AgentKind::box : AgentKind::person,
                                         2.5 * unit(random), 2.5 * unit(random), 3 * unit(random));
      definition.size = {0.3 + 0.2 * unit(random), 0.5, 0.5};
      if (!simulation.spawn(definition, std::nullopt).ok()) continue;
      Footprint footprint =
          i % 2 ? make_rectangle(definition.size.x(), definition.size.y()) : make_disc({0, 0}, 0.3);
      place(footprint, planar_pose(definition.T_map_base), footprints.emplace_back());
    }
    for (int i = 0; i < 20; ++i) {
      const Pose2 pose{unit(random), unit(random), 3 * unit(random)};
      Footprint placed;
      place(make_polygon(robot().footprint), pose, placed);
      bool free = true;
      for (const Footprint& footprint : footprints) free = free && signed_distance(placed, footprint) > 0.01;
      if (!free) continue;
      const Twist2 twist{unit(random), i % 3 ? 0 : 0.5 * unit(random), i % 4 ? 2 * unit(random) : 0};
      const double slow = dense_distance(footprints, pose, twist, 2.0);
      const auto fast =
          simulation.clearance(Transform<Map, Base>::planar(pose.x, pose.y, pose.yaw), twist, 2.0);
      EXPECT_LE(fast.distance, slow + 1e-9) << "never more than there is";
      // Grazing: a gap of less than the contact distance of a millimetre may be a hit for only one of them.
      std::vector<Footprint> thicker = footprints;
      for (Footprint& footprint : thicker) footprint.radius += 0.002;
      EXPECT_GE(fast.distance, dense_distance(thicker, pose, twist, 2.0) - 0.004);
      hits += slow < 2.0;
    }
  }
  EXPECT_GT(hits, 100);
}

TEST(Clearance, AStraightPathIsMeasuredFromTheFront) {
  Simulation simulation = make();
  spawn(simulation, agent("crate", AgentKind::box, 2, 0));
  const auto clear = simulation.clearance(Transform<Map, Base>::planar(0, 0, 0), {0.5, 0, 0}, 5);
  EXPECT_NEAR(clear.distance, 2 - 0.2 - 0.25, 0.0011);
  EXPECT_EQ(clear.agent, "crate");
  EXPECT_EQ(simulation.clearance(Transform<Map, Base>::planar(0, 0, 0), {-0.5, 0, 0}, 5).distance, 5);
}

TEST(Clearance, TurningOnTheSpotIncludesTheSweptCorners) {
  Simulation simulation = make();
  AgentDefinition crate = agent("crate", AgentKind::box, 0, 0.5);
  crate.size = {0.4, 0.4, 0.5};
  spawn(simulation, crate);  // 0.10 m beside the robot's flank
  EXPECT_LT(simulation.clearance(Transform<Map, Base>::planar(0, 0, 0), {0, 0, 1}, 1).distance, 0.5);
  EXPECT_EQ(simulation.clearance(Transform<Map, Base>::planar(0, 0, 0), {0.5, 0, 0}, 1).distance, 1);
}

TEST(Clearance, OnlyMotionOutOfAContactIsAllowed) {
  Simulation simulation = make();
  spawn(simulation, agent("crate", AgentKind::box, 0.43, 0));  // overlaps the front by 2 cm
  const auto base = Transform<Map, Base>::planar(0, 0, 0);
  const auto back = simulation.clearance(base, {-0.3, 0, 0}, 2);
  EXPECT_TRUE(back.moving_out);
  EXPECT_EQ(back.distance, 2);
  const auto ahead = simulation.clearance(base, {0.3, 0, 0}, 2);
  EXPECT_FALSE(ahead.moving_out);
  EXPECT_EQ(ahead.distance, 0);
  const auto still = simulation.clearance(base, {}, 2);
  EXPECT_FALSE(still.moving_out);
}

TEST(Clearance, MotionOutOfAContactStillChecksBehind) {
  Simulation simulation = make();
  spawn(simulation, agent("crate", AgentKind::box, 0.43, 0));
  spawn(simulation, agent("barrel", AgentKind::barrel, -1.0, 0));
  const auto back = simulation.clearance(Transform<Map, Base>::planar(0, 0, 0), {-0.3, 0, 0}, 2);
  EXPECT_TRUE(back.moving_out);
  EXPECT_NEAR(back.distance, 1.0 - 0.25 - 0.2, 0.0011);
  EXPECT_EQ(back.agent, "barrel");
}

}  // namespace
}  // namespace parhelion::simulation
