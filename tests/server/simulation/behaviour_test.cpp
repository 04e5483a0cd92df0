#include <set>

#include "tests/long_run.hpp"
#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

SemanticModel furnished_room() {
  SemanticModel model = room(12);
  model.entities.push_back(model_box("table", EntityLabel::unknown, {2, 2, 0.4}, {1.6, 0.8, 0.8}, 0.4));
  model.entities.push_back(model_box("shelf", EntityLabel::unknown, {-4, 3, 0.9}, {0.4, 2.0, 1.8}));
  model.entities.push_back(model_box("pillar 1", EntityLabel::pillar, {-1, -3, 1.25}, {0.4, 0.4, 2.5}, 0.7));
  model.entities.push_back(model_box("pillar 2", EntityLabel::pillar, {3, -2, 1.25}, {0.4, 0.4, 2.5}));
  model.entities.push_back(model_box("partition", EntityLabel::wall, {-3, -0.5, 1.25}, {3.0, 0.1, 2.5}, 0.1));
  model.entities.push_back(model_box("sofa", EntityLabel::unknown, {0, 5, 0.4}, {2.0, 0.8, 0.8}));
  return model;
}

/// A real robot driven slowly around the room on a circle, with stops.
RealRobotState driven(double t) {
  const double angle = 0.05 * t, radius = 1.2;
  return real_at(radius * std::cos(angle), radius * std::sin(angle), angle + std::numbers::pi / 2,
                 {0.06, 0, 0.05});
}

TEST(Behaviour, TenWanderersHitNeitherWallsNorTheRealRobot) {
  Simulation simulation = make(furnished_room());
  const double places[10][2] = {{4, 4},      {-2, 2},   {4, 0}, {-4.5, -3}, {0, -4.5},
                                {4.5, -4.5}, {-2, 4.5}, {2, 4}, {-5, 1},    {2, -4}};
  for (int i = 0; i < 10; ++i) {
    spawn(simulation,
          moving("a" + std::to_string(i), i % 3 == 2 ? AgentKind::person : AgentKind::robot, places[i][0],
                 places[i][1], BehaviourKind::wander, 0.3 + 0.05 * i),
          driven(0));
  }
  std::vector<LaserRequest> requests;
  const double minutes = test::long_run() ? 60 : 10;
  const auto steps = static_cast<int>(minutes * 60 * 240);
  std::vector<std::set<std::pair<int, int>>> visited(10);
  WorldSnapshot world;
  for (int i = 0; i < steps; ++i) {
    simulation.step(driven(i / 240.0), requests);
    if (i % 240 != 0) continue;
    for (std::size_t a = 0; a < 10; ++a) {
      const Eigen::Vector3d p = body(simulation, "a" + std::to_string(a)).T_map_body.translation();
      visited[a].insert({static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y()))});
    }
  }
  std::size_t among_themselves = 0;
  for (const Event& event : simulation.take_events()) {
    if (event.kind != EventKind::contact_started) continue;
    EXPECT_EQ(event.pair, PairKind::virtual_virtual)
        << event.subject << " hit " << event.object << " at " << event.position.transpose() << " after "
        << (event.stamp - kStart).seconds() << " s";
    among_themselves += event.pair == PairKind::virtual_virtual;
  }
  std::size_t smallest = visited[0].size();
  for (const auto& squares : visited) smallest = std::min(smallest, squares.size());
  std::cout << "agents hit each other " << static_cast<double>(among_themselves) / minutes
            << " times a minute; the laziest came to " << smallest << " of 144 square metres\n";
  EXPECT_LE(static_cast<double>(among_themselves), minutes) << "together less than one bump a minute";
  EXPECT_GE(smallest, 15U) << "wanders";
}

TEST(Behaviour, APatrolVisitsItsWaypointsInTurnAroundAnObstacle) {
  SemanticModel model = room(12);
  model.entities.push_back(model_box("pillar", EntityLabel::pillar, {0, 0, 1.25}, {0.6, 0.6, 2.5}));
  for (const AgentKind kind : {AgentKind::robot, AgentKind::person}) {
    Simulation simulation = make(model);
    AgentDefinition guard = moving("guard", kind, -4, 0, BehaviourKind::patrol, 0.8);
    guard.behaviour.waypoints = {{4, 0}, {4, 4}, {-4, 0}};
    spawn(simulation, guard);
    std::vector<int> reached;
    std::vector<LaserRequest> requests;
    for (int i = 0; i < 240 * 120; ++i) {
      simulation.step({}, requests);
      if (i % 24 != 0) continue;
      const Eigen::Vector3d p = body(simulation, "guard").T_map_body.translation();
      for (int w = 0; w < 3; ++w) {
        const bool there =
            (guard.behaviour.waypoints[static_cast<std::size_t>(w)] - p.head<2>()).norm() < 0.35;
        if (there && (reached.empty() || reached.back() != w)) reached.push_back(w);
      }
    }
    // It starts at its last waypoint.
    ASSERT_GE(reached.size(), 7U) << to_string(kind);
    for (std::size_t i = 0; i < reached.size(); ++i) EXPECT_EQ(reached[i], static_cast<int>((i + 2) % 3));
    EXPECT_EQ(count(simulation.take_events(), EventKind::contact_started), 0U);
  }
}

TEST(Behaviour, AgentsStopForTheRealRobotOnTheirPath) {
  SemanticModel corridor;
  corridor.entities.push_back(model_box("left", EntityLabel::wall, {0, 0.75, 1}, {12, 0.1, 2}));
  corridor.entities.push_back(model_box("right", EntityLabel::wall, {0, -0.75, 1}, {12, 0.1, 2}));
  corridor.entities.push_back(model_box("end", EntityLabel::wall, {-6, 0, 1}, {0.1, 1.5, 2}));
  Simulation simulation = make(corridor);
  AgentDefinition guard = moving("guard", AgentKind::robot, -4, 0, BehaviourKind::patrol, 0.8);
  guard.behaviour.waypoints = {{4, 0}};
  const RealRobotState real = real_at(0, 0);
  spawn(simulation, guard, real);
  run(simulation, 60, real);
  EXPECT_LT(body(simulation, "guard").T_map_body.translation().x(), -0.5);
  EXPECT_EQ(count(simulation.take_events(), EventKind::contact_started), 0U);
}

// Its path leads behind the robot that pushes it against the wall: it must not turn on the spot until it is
// hit.
TEST(Behaviour, AgentsPressedAgainstAWallGetAwayInTime) {
  for (int start = 0; start < 8; ++start) {
    Simulation simulation = make(room(12));
    AgentDefinition guard = moving("guard", AgentKind::robot, 0.05 * start, 5.45, BehaviourKind::patrol, 0.5);
    guard.T_map_base = Transform<Map, Base>::planar(0.05 * start, 5.45, start * 0.8);
    guard.behaviour.waypoints = {{0, -4}};
    const auto pressing = [](double t) {
      return real_at(0, 4.2 + 0.06 * t, std::numbers::pi / 2, {0.06, 0, 0});
    };
    spawn(simulation, guard, pressing(0));
    std::vector<LaserRequest> requests;
    for (int i = 0; i < 240 * 22; ++i) simulation.step(pressing(i / 240.0), requests);
    for (const Event& event : simulation.take_events())
      EXPECT_NE(event.kind, EventKind::contact_started)
          << "start " << start << ", with " << event.object << " after " << (event.stamp - kStart).seconds();
  }
}

TEST(Behaviour, AgentsNearARobotThatCannotSeeThemStop) {
  Simulation simulation = make(room(30));
  spawn(simulation, moving("near", AgentKind::robot, 1.5, 0, BehaviourKind::wander));
  spawn(simulation, moving("far", AgentKind::robot, 10, 0, BehaviourKind::wander));
  RealRobotState real = real_at(0, 0);
  run(simulation, 0.1, real);
  real.injection_live = false;
  run(simulation, 1, real);
  const Eigen::Vector3d near = body(simulation, "near").T_map_body.translation();
  const Eigen::Vector3d far = body(simulation, "far").T_map_body.translation();
  run(simulation, 4, real);
  EXPECT_LT((body(simulation, "near").T_map_body.translation() - near).norm(), 1e-6);
  EXPECT_GT((body(simulation, "far").T_map_body.translation() - far).norm(), 0.3);
}

TEST(Behaviour, NoAgentReappearsInsideTheStoppingDistance) {
  Simulation simulation = make(room(20));
  spawn(simulation, agent("crate", AgentKind::box, 0.75, 0));
  RealRobotState real = real_at(-2, 0, 0, {1, 0, 0});
  run(simulation, 0.5, real);
  real.injection_live = false;
  run(simulation, 0.5, real);
  // At its relocalization the crate is half a metre ahead at 1 m/s.
  real = real_at(0, 0, 0, {1, 0, 0});
  real.relocalized = true;
  std::vector<LaserRequest> requests;
  simulation.step(real, requests);
  EXPECT_GE((body(simulation, "crate").T_map_body.translation() - Eigen::Vector3d(0.75, 0, 0)).norm(), 0.3);
  const auto events = simulation.take_events();
  EXPECT_EQ(count(events, EventKind::agent_moved), 1U);
  EXPECT_EQ(count(events, EventKind::contact_started), 0U);
}

TEST(Behaviour, ContactsWithoutSensingAreFlagged) {
  Simulation simulation = make(room(20));
  spawn(simulation, agent("crate", AgentKind::box, 1.0, 0));
  std::vector<LaserRequest> requests;
  for (int i = 0; i <= 480; ++i) {
    RealRobotState real = real_at(0.5 * i / 240, 0, 0, {0.5, 0, 0});
    real.injection_live = i < 10;
    simulation.step(real, requests);
  }
  const auto events = simulation.take_events();
  ASSERT_EQ(count(events, EventKind::contact_started), 1U);
  for (const Event& event : events) {
    EXPECT_TRUE(event.undetectable || event.kind != EventKind::contact_started);
  }
}

TEST(Behaviour, AgentsAvoidPeopleMissingFromTheModel) {
  Simulation simulation = make(room(12));
  AgentDefinition guard = moving("guard", AgentKind::robot, -4, 0, BehaviourKind::patrol, 0.8);
  guard.behaviour.waypoints = {{4, 0}, {-4, 0}};
  spawn(simulation, guard);
  simulation.set_real_obstacles({{{0, 0}, 0.3}, {{2, 0.2}, 0.3}});
  double nearest = 10;
  std::vector<LaserRequest> requests;
  double farthest = -10;
  for (int i = 0; i < 240 * 40; ++i) {
    simulation.step({}, requests);
    if (i % 12 != 0) continue;
    const Eigen::Vector3d p = body(simulation, "guard").T_map_body.translation();
    nearest = std::min({nearest, p.head<2>().norm(), (p.head<2>() - Eigen::Vector2d(2, 0.2)).norm()});
    farthest = std::max(farthest, p.x());
  }
  EXPECT_GT(nearest, 0.3 + 0.25);
  EXPECT_GT(farthest, 3.5);
}

TEST(Behaviour, ARobotWithALaserRequestsAndUsesScans) {
  Simulation simulation = make();
  AgentDefinition rover = moving("rover", AgentKind::robot, 0, 0, BehaviourKind::patrol, 0.6);
  rover.behaviour.waypoints = {{8, 0}};
  rover.laser = "lms-200";
  spawn(simulation, rover);
  std::vector<LaserRequest> requests;
  std::size_t asked = 0;
  for (int i = 0; i < 240 * 10; ++i) {
    requests.clear();
    simulation.step({}, requests);
    for (const LaserRequest& request : requests) {
      ++asked;
      EXPECT_EQ(request.agent, "rover");
      EXPECT_EQ(request.own_bodies.size(), 3U);
      EXPECT_NEAR(request.T_map_laser.translation().z(), 0.30, 1e-9);
      // A wall across its path at x = 3, known only from its laser.
      Scan scan;
      scan.angle_min = static_cast<float>(request.laser.angle_min);
      scan.angle_increment = static_cast<float>(request.laser.angle_increment);
      for (int beam = 0; beam < request.laser.beams; ++beam) {
        const double angle =
            request.T_map_laser.yaw() + request.laser.angle_min + beam * request.laser.angle_increment;
        const double range = (3 - request.T_map_laser.translation().x()) / std::cos(angle);
        scan.ranges.push_back(std::cos(angle) > 0.01 && range < 8
                                  ? static_cast<float>(range)
                                  : request.laser.convention.no_return_sentinel());
      }
      simulation.give_scan("rover", scan);
    }
  }
  EXPECT_GE(asked, 50U);
  EXPECT_LT(body(simulation, "rover").T_map_body.translation().x(), 3 - 0.26);
}

}  // namespace
}  // namespace parhelion::simulation
