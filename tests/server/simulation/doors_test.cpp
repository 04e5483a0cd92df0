// Doors: real ones at their reported angle; drawn ones, and all doors of levels 1 and 2, moved by the
// physics.
#include <gmock/gmock.h>

#include "server/simulation/building/model_net.hpp"
#include "tests/degree.hpp"
#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

using test::kDegree;

/// A room of 8 m; a wall across it at x = 2 with a door 1 m wide at y = 0, hinged at y = -0.5, that opens a
/// quarter turn towards -x and is drawn closed.
SemanticModel two_rooms(bool is_virtual = false) {
  SemanticModel model = room(8);
  model.entities.push_back(model_box("wall 7.1", EntityLabel::wall, {2, -2.25, 1.25}, {0.1, 3.5, 2.5}));
  model.entities.back().part_of = "wall 7";
  model.entities.push_back(model_box("wall 7.2", EntityLabel::wall, {2, 2.25, 1.25}, {0.1, 3.5, 2.5}));
  model.entities.back().part_of = "wall 7";
  ModelEntity door = model_box("door 3", EntityLabel::door, {2, 0, 1.0}, {1.0, 0.04, 2.0});
  door.T_map_body = Transform<Map, Body>::planar(2, 0, std::numbers::pi / 2, 1.0);
  door.part_of = "wall 7";
  door.is_virtual = is_virtual;
  door.hinge = Hinge{{-0.5, 0}, 0, std::numbers::pi / 2, 0};
  model.entities.push_back(door);
  model.entities.push_back(
      model_box("wall above door 3", EntityLabel::wall_above_door, {2, 0, 2.25}, {0.1, 1.0, 0.5}));
  model.entities.push_back(
      model_box("free space of door 3", EntityLabel::free_space, {2, 0, 1.0}, {0.3, 1.0, 2.0}));
  model.relations.push_back({RelationKind::connected_via_joint, "door 3", "wall 7.1", 0.9});
  model.relations.push_back({RelationKind::available_inside, "free space of door 3", "wall 7.1", 0.9});
  return model;
}

DoorCommand door_command(const std::string& door, double opening) {
  return {.door = door, .opening = opening};
}

DoorState state_of(const Simulation& simulation, const std::string& name = "door 3") {
  for (const DoorState& door : simulation.doors()) {
    if (door.name == name) return door;
  }
  ADD_FAILURE() << "no " << name;
  return {};
}

std::vector<Event> of_kind(const std::vector<Event>& events, EventKind kind) {
  std::vector<Event> found;
  for (const Event& event : events) {
    if (event.kind == kind) found.push_back(event);
  }
  return found;
}

TEST(RealDoor, StartsAtTheModelAngleWithUnknownState) {
  Simulation simulation = make(two_rooms());
  run(simulation, 1);
  const BodyState leaf = body(simulation, "door 3");
  EXPECT_EQ(leaf.T_map_body.translation(), Eigen::Vector3d(2, 0, 1));
  EXPECT_FALSE(leaf.known);
  EXPECT_FALSE(state_of(simulation).known);
  EXPECT_FALSE(state_of(simulation).dynamic);
  EXPECT_TRUE(simulation.take_events().empty());
}

TEST(RealDoor, FollowsTheSensorsAndBecomesUnknownWithoutThem) {
  Simulation simulation = make(two_rooms());
  simulation.observe_door("door 3", 0);
  run(simulation, 0.1);
  EXPECT_TRUE(state_of(simulation).known);
  EXPECT_TRUE(simulation.take_events().empty()) << "found closed is not closed now";
  simulation.observe_door("door 3", 60 * kDegree);
  run(simulation, 1);
  EXPECT_NEAR(state_of(simulation).opening, 60 * kDegree, 1e-12);
  // Hinged at (2, -0.5), half a metre from the leaf's middle, which turns from +y towards -x.
  const Eigen::Vector3d middle = body(simulation, "door 3").T_map_body.translation();
  EXPECT_NEAR(middle.x(), 2 - 0.5 * std::sin(60 * kDegree), 1e-9);
  EXPECT_NEAR(middle.y(), -0.5 + 0.5 * std::cos(60 * kDegree), 1e-9);
  const auto opened = of_kind(simulation.take_events(), EventKind::door_opened);
  ASSERT_EQ(opened.size(), 1U);
  EXPECT_EQ(opened[0].object, "door 3");
  EXPECT_EQ(opened[0].text, "in wall 7");
  EXPECT_NEAR(opened[0].value, 10 * kDegree, 1.5 * kDegree);
  simulation.observe_door("door 3", std::nullopt);
  run(simulation, 0.1);
  EXPECT_FALSE(body(simulation, "door 3").known);
  EXPECT_NEAR(state_of(simulation).opening, 60 * kDegree, 1e-12) << "the last that was known";
}

TEST(RealDoor, InstructorCommandOverridesDoorSensorsUntilWithdrawn) {
  Simulation simulation = make(two_rooms());
  simulation.observe_door("door 3", 20 * kDegree);
  ASSERT_TRUE(simulation.set_door(door_command("door 3", 80 * kDegree)).ok());
  run(simulation, 1);
  EXPECT_NEAR(state_of(simulation).opening, 80 * kDegree, 1e-9);
  ASSERT_TRUE(simulation.set_door({.door = "door 3"}).ok());
  run(simulation, 1);
  EXPECT_NEAR(state_of(simulation).opening, 20 * kDegree, 1e-9);
}

TEST(RealDoor, InvalidCommandsAreRefusedWithValidOptions) {
  Simulation simulation = make(two_rooms());
  Status refused = simulation.set_door(door_command("door 2", 0));
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, testing::HasSubstr("did you mean 'door 3'"));
  refused = simulation.set_door(door_command("door 3", -30 * kDegree));
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, testing::HasSubstr("0 deg to 90 deg"));
}

/// Drives the real robot from x = 0 to 1.74 at 0.5 m/s, its front then 1 cm from a closed door.
std::vector<Event> drive_at_door(Simulation& simulation) {
  std::vector<LaserRequest> requests;
  for (int i = 0; i <= 840; ++i) {
    RealRobotState real = real_at(1.74 * i / 840, 0, 0, {0.5, 0, 0});
    real.sigma = 0.02;
    simulation.step(real, requests);
  }
  return simulation.take_events();
}

TEST(RealDoor, TheRealRobotHitsADoorKnownToBeClosed) {
  for (const bool known : {true, false}) {
    Simulation simulation = make(two_rooms());
    if (known) simulation.observe_door("door 3", 0);
    const auto hits = of_kind(drive_at_door(simulation), EventKind::contact_started);
    ASSERT_EQ(hits.size(), known ? 1U : 0U);
    if (known) {
      EXPECT_EQ(hits[0].object, "door 3");
      EXPECT_EQ(hits[0].pair, PairKind::real_real);
    }
  }
}

TEST(RealDoor, AgentsPassOnlyDoorsKnownToBeOpen) {
  for (const double opening : {0.0, 85 * kDegree}) {
    Simulation simulation = make(two_rooms());
    simulation.observe_door("door 3", opening);
    AgentDefinition walker = moving("walker", AgentKind::person, 0.5, 0.1, BehaviourKind::patrol, 1.0);
    walker.behaviour.waypoints = {{3.2, 0.1}};
    spawn(simulation, walker);
    run(simulation, 8);
    const double x = body(simulation, "walker", "torso").T_map_body.translation().x();
    if (opening > 0) {
      EXPECT_GT(x, 2.6);
    } else {
      EXPECT_LT(x, 1.8);
    }
  }
}

TEST(RealDoor, PushesAnAgentInItsSwing) {
  Simulation simulation = make(two_rooms());
  simulation.observe_door("door 3", 0);
  AgentDefinition crate = agent("crate", AgentKind::box, 1.5, 0.2);
  spawn(simulation, crate);
  run(simulation, 0.1);
  for (int i = 0; i <= 80; ++i) {  // 80 degrees in 2 s
    simulation.observe_door("door 3", i * kDegree);
    run(simulation, 0.025);
  }
  EXPECT_GT((body(simulation, "crate").T_map_body.translation() - Eigen::Vector3d(1.5, 0.2, 0)).norm(), 0.1);
}

/// An agent that goes from the far side through the door, pushing it in its opening direction.
AgentDefinition through_the_door(AgentKind kind) {
  AgentDefinition walker = moving("walker", kind, 3.3, 0.1, BehaviourKind::go, 0.8);
  walker.T_map_base = Transform<Map, Base>::planar(3.3, 0.1, std::numbers::pi);
  walker.behaviour.waypoints = {{0, 0.1}};
  return walker;
}

SimulationOptions with_door(DoorSettings settings, int level = 1) {
  settings.name = "door 3";
  SimulationOptions options;
  options.level = level;
  options.doors = {settings};
  return options;
}

TEST(HungDoor, IsPushedOpenAndStaysAtItsAngle) {
  for (const AgentKind kind : {AgentKind::person, AgentKind::robot}) {
    Simulation simulation = make(two_rooms(true));
    ASSERT_TRUE(state_of(simulation).dynamic) << "a drawn door moves by itself at level 3 too";
    spawn(simulation, through_the_door(kind));
    run(simulation, 12);
    const auto events = simulation.take_events();
    const auto opened = of_kind(events, EventKind::door_opened);
    ASSERT_EQ(opened.size(), 1U);
    EXPECT_EQ(opened[0].subject, "walker");
    EXPECT_EQ(opened[0].object, "door 3");
    EXPECT_EQ(opened[0].pair, PairKind::virtual_virtual);
    EXPECT_EQ(of_kind(events, EventKind::door_space_left).size(), 1U);
    EXPECT_EQ(of_kind(events, EventKind::goal_reached).size(), 1U);
    const double left_at = state_of(simulation).opening;
    EXPECT_GT(left_at, 20 * kDegree);
    EXPECT_LE(left_at, 91 * kDegree);
    run(simulation, 2);
    EXPECT_NEAR(state_of(simulation).opening, left_at, 1 * kDegree);
  }
}

TEST(HungDoor, BlocksAgentsThatDoNotOpenDoors) {
  Simulation simulation = make(two_rooms(true));
  AgentDefinition walker = through_the_door(AgentKind::person);
  walker.behaviour.opens_doors = false;
  spawn(simulation, walker);
  run(simulation, 20);
  const auto unreachable = of_kind(simulation.take_events(), EventKind::goal_unreachable);
  ASSERT_EQ(unreachable.size(), 1U);
  EXPECT_THAT(unreachable[0].text, testing::HasSubstr("closed: 'door 3'"));
  EXPECT_NEAR(state_of(simulation).opening, 0, 1 * kDegree);
}

TEST(HungDoor, BlocksAgentsThatWouldHaveToPull) {
  Simulation simulation = make(two_rooms(true));
  AgentDefinition walker = moving("walker", AgentKind::person, 0.5, 0.1, BehaviourKind::go, 0.8);
  walker.behaviour.waypoints = {{3.2, 0.1}};
  spawn(simulation, walker);
  run(simulation, 10);
  EXPECT_EQ(of_kind(simulation.take_events(), EventKind::goal_unreachable).size(), 1U);
  ASSERT_TRUE(simulation.set_door(door_command("door 3", 85 * kDegree)).ok());
  run(simulation, 15);
  EXPECT_EQ(of_kind(simulation.take_events(), EventKind::goal_reached).size(), 1U) << "it stands open now";
}

TEST(HungDoor, AllUnlockedDoorsMoveAtLevelsOneAndTwo) {
  for (const bool locked : {false, true}) {
    DoorSettings settings;
    settings.locked = locked;
    Simulation simulation = make(two_rooms(), with_door(settings));
    EXPECT_EQ(state_of(simulation).dynamic, !locked);
    EXPECT_TRUE(state_of(simulation).known);
    spawn(simulation, through_the_door(AgentKind::person));
    run(simulation, 12);
    if (locked)
      EXPECT_EQ(state_of(simulation).opening, 0);
    else
      EXPECT_GT(state_of(simulation).opening, 20 * kDegree);
  }
}

TEST(HungDoor, ACloserShutsItAtTheSpeedOfTheCloser) {
  DoorSettings settings;
  settings.closer = 15;
  settings.angle = 80 * kDegree;
  Simulation simulation = make(two_rooms(), with_door(settings));
  EXPECT_NEAR(state_of(simulation).opening, 80 * kDegree, 1e-9);
  run(simulation, 1);
  EXPECT_GT(state_of(simulation).opening, 80 * kDegree - 0.9) << "its damper allows 0.8 rad/s";
  run(simulation, 3);
  EXPECT_NEAR(state_of(simulation).opening, 0, 1 * kDegree);
  EXPECT_EQ(of_kind(simulation.take_events(), EventKind::door_closed).size(), 1U);
  run(simulation, 2);
  EXPECT_NEAR(state_of(simulation).opening, 0, 1 * kDegree);
}

TEST(HungDoor, BreaksOffItsHingeUnderExcessiveForce) {
  for (const double holds : {5.0, 0.0}) {
    DoorSettings settings;
    settings.break_impulse = holds;
    Simulation simulation = make(two_rooms(), with_door(settings));
    // The real robot continues against the side to which the door does not open.
    std::vector<LaserRequest> requests;
    for (int i = 0; i < 240; ++i)
      simulation.step(real_at(1.65 + 0.4 * i / 240, 0.2, 0, {0.4, 0, 0}), requests);
    run(simulation, 2, real_at(2.05, 0.2));
    const auto events = simulation.take_events();
    const auto broken = of_kind(events, EventKind::door_unhinged);
    if (holds == 0) {
      EXPECT_TRUE(broken.empty()) << "nothing breaks it";
      continue;
    }
    ASSERT_EQ(broken.size(), 1U);
    EXPECT_EQ(broken[0].subject, "pioneer");
    EXPECT_EQ(broken[0].object, "door 3");
    EXPECT_GT(broken[0].impulse, holds);
    EXPECT_TRUE(state_of(simulation).unhinged);
    const Status refused = simulation.set_door(door_command("door 3", 0.5));
    ASSERT_FALSE(refused.ok());
    EXPECT_THAT(refused.error().message, testing::HasSubstr("off its hinge"));
  }
}

TEST(HungDoor, MovesAtOnceToTheCommandedAngle) {
  Simulation simulation = make(two_rooms(true));
  ASSERT_TRUE(simulation.set_door(door_command("door 3", 70 * kDegree)).ok());
  run(simulation, 2);
  EXPECT_NEAR(state_of(simulation).opening, 70 * kDegree, 0.5 * kDegree);
  const DoorState state = state_of(simulation);
  EXPECT_NEAR(state.T_map_leaf.translation().x(), 2 - 0.5 * std::sin(state.opening), 1e-3);
  EXPECT_NEAR(state.T_map_leaf.translation().y(), -0.5 + 0.5 * std::cos(state.opening), 1e-3);
  EXPECT_NEAR(state.T_map_leaf.translation().z(), 1, 1e-3);
}

TEST(HungDoor, HasHandlesOnBothSidesOppositeTheHinge) {
  Simulation simulation = make(two_rooms(true));
  for (const auto& each : simulation.scene()->bodies) {
    if (each->entity != "door 3") continue;
    EXPECT_TRUE(each->injectable);
    ASSERT_EQ(each->shapes.size(), 3U);
    for (std::size_t i = 1; i < 3; ++i) EXPECT_GT(each->shapes[i].T_body_shape.translation().x(), 0.3);
  }
}

TEST(HungDoor, MovesTheSameOnEachRun) {
  std::vector<double> first;
  for (int round = 0; round < 3; ++round) {
    Simulation simulation = make(two_rooms(true));
    spawn(simulation, through_the_door(AgentKind::person));
    std::vector<double> angles;
    for (int i = 0; i < 100; ++i) {
      run(simulation, 0.05);
      angles.push_back(state_of(simulation).opening);
    }
    if (round == 0) first = angles;
    EXPECT_EQ(angles, first);
  }
}

TEST(DoorSpace, ReportsWhoEntersAndLeaves) {
  Simulation simulation = make(two_rooms());
  simulation.observe_door("door 3", 85 * kDegree);
  std::vector<LaserRequest> requests;
  for (int i = 0; i <= 960; ++i) simulation.step(real_at(1 + 2.0 * i / 960, 0, 0, {0.5, 0, 0}), requests);
  const auto events = simulation.take_events();
  const auto in = of_kind(events, EventKind::door_space_entered);
  const auto out = of_kind(events, EventKind::door_space_left);
  ASSERT_EQ(in.size(), 1U);
  ASSERT_EQ(out.size(), 1U);
  EXPECT_EQ(in[0].subject, "pioneer");
  EXPECT_EQ(in[0].object, "door 3");
  EXPECT_EQ(in[0].text, "in wall 7");
  EXPECT_EQ(in[0].pair, PairKind::real_real);
  // Its front comes to x = 1.85, its back leaves 2.15 by the margin.
  EXPECT_NEAR(in[0].position.x() + 0.25, 1.85, 0.01);
  EXPECT_NEAR(out[0].position.x() - 0.25, 2.15 + 0.05, 0.01);
}

TEST(DoorHistory, APastScanSeesTheLeafAtItsPastAngle) {
  Simulation simulation = make(two_rooms());
  simulation.observe_door("door 3", 0);
  run(simulation, 0.5);
  simulation.observe_door("door 3", 90 * kDegree);
  std::vector<std::pair<SimulationTime, double>> seen;
  for (int i = 0; i < 120; ++i) {
    run(simulation, 1.0 / 240);
    seen.emplace_back(simulation.now(), body(simulation, "door 3").T_map_body.yaw());
  }
  WorldSnapshot reused;
  for (const auto& [t, yaw] : seen) {
    for (const int back : {0, 2}) {
      WorldSnapshot fresh;
      ASSERT_TRUE(simulation.at(t - milliseconds(back), fresh));
      ASSERT_TRUE(simulation.at(t - milliseconds(back), reused));
      ASSERT_EQ(fresh.bodies.size(), reused.bodies.size());
      for (std::size_t i = 0; i < fresh.bodies.size(); ++i) {
        ASSERT_EQ(fresh.bodies[i].id, reused.bodies[i].id);
        ASSERT_TRUE(i == 0 || fresh.bodies[i - 1].id < fresh.bodies[i].id);
        ASSERT_EQ(fresh.bodies[i].T_map_body.isometry().matrix(),
                  reused.bodies[i].T_map_body.isometry().matrix());
      }
      if (back == 0) {
        for (const BodyState& state : fresh.bodies) {
          const bool leaf = state.id == body(simulation, "door 3").id;
          EXPECT_TRUE(!leaf || state.T_map_body.yaw() == yaw);
        }
      }
    }
  }
  EXPECT_GT(seen.back().second - seen.front().second, 60 * kDegree);
}

TEST(ModelNet, NamesTheOwnerOfAShape) {
  SemanticModel model = two_rooms();
  ModelEntity step = model_box("step 2", EntityLabel::stairs, {0, 3, 0.1}, {0.3, 1, 0.2});
  step.part_of = "stairs 1";
  model.entities.push_back(step);
  const ModelNet net(model);
  EXPECT_EQ(net.place("door 3"), "in wall 7");
  EXPECT_EQ(net.place("free space of door 3"), "in wall 7") << "by its relation";
  EXPECT_EQ(net.place("step 2"), "of stairs 1");
  EXPECT_EQ(net.place("wall 1"), "");
  EXPECT_EQ(net.place("nothing"), "");
  EXPECT_EQ(net.relations("door 3").size(), 1U);
  EXPECT_EQ(net.relations("wall 7.1").size(), 2U);
}

}  // namespace
}  // namespace parhelion::simulation
