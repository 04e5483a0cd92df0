// Gripper events: each with known answers, then with the crawler's arm by JOINT_CMD.
#include "server/simulation/bodies/handling.hpp"

#include <map>

#include "robots_world.hpp"
#include "tests/degree.hpp"
#include "tests/server/tick/crawler_arm.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

using test::kDegree;

/// A gripper, one load and the resulting events, step by step.
class LoadHandling : public testing::Test {
 protected:
  LoadHandling() {
    at.T_map_body = Transform<Map, Body>(Eigen::Quaterniond::Identity(), {1, 0, 0});
    at.lowest = 0;
  }
  /// Both fingers with `force`, the load at `height` and sinking with `sinks` m/s.
  std::vector<Event> step(double force, double height, double sinks = 0) {
    now = now + seconds(kStep);
    at.T_map_body = Transform<Map, Body>(Eigen::Quaterniond::Identity(), {1, 0, height});
    at.center = at.T_map_body * Eigen::Vector3d(0, 0, 0.08);
    at.lowest = height;
    at.velocity = {0, 0, -sinks};
    const std::vector<FingerForce> forces{{&load, 0, force}, {&load, 1, force}};
    std::vector<Event> events;
    watch.update(
        "r", PairKind::real_virtual, Eigen::Vector3d(1, 0, height + 0.12 + slid), forces,
        [&](const std::string&) { return there ? std::optional(at) : std::nullopt; }, now, events);
    return events;
  }
  static std::vector<EventKind> kinds(const std::vector<Event>& events) {
    std::vector<EventKind> kinds;
    for (const Event& event : events) kinds.push_back(event.kind);
    return kinds;
  }
  std::string load = "load";
  GripperWatch watch;
  HandledBody at;
  bool there = true;
  double slid = 0;
  SimulationTime now;
};

using Kinds = std::vector<EventKind>;

TEST_F(LoadHandling, GrippedIsReportedImmediatelyWithTheSmallerForce) {
  EXPECT_TRUE(step(0.9, 0).empty()) << "less than the pinch";
  const auto events = step(5, 0);
  ASSERT_EQ(kinds(events), Kinds{EventKind::gripped});
  EXPECT_EQ(events[0].stamp, now);
  EXPECT_EQ(events[0].subject, "r");
  EXPECT_EQ(events[0].object, "load");
  EXPECT_EQ(events[0].pair, PairKind::real_virtual);
  EXPECT_EQ(events[0].value, 5);
  EXPECT_TRUE(step(5, 0).empty());
  // A loss of contact shorter than kReleaseTime is not a release.
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(step(0, 0).empty());
  EXPECT_TRUE(step(5, 0).empty());
  for (int i = 0; i < 30; ++i) step(0, 0);
  EXPECT_EQ(kinds(step(5, 0)), Kinds{EventKind::gripped}) << "let go of, and gripped again";
}

TEST_F(LoadHandling, OneFingerDoesNotGrip) {
  const std::vector<FingerForce> forces{{&load, 0, 50}};
  std::vector<Event> events;
  watch.update(
      "r", PairKind::none, {1, 0, 0.1}, forces, [&](const std::string&) { return at; }, now, events);
  EXPECT_TRUE(events.empty());
}

TEST_F(LoadHandling, LiftedIsReportedAboveTwoCentimetresOncePerLift) {
  step(5, 0.1);  // it was 0.1 m high
  EXPECT_TRUE(step(5, 0.119).empty());
  const auto events = step(5, 0.121);
  ASSERT_EQ(kinds(events), Kinds{EventKind::lifted});
  EXPECT_NEAR(events[0].value, 0.021, 1e-12);
  EXPECT_TRUE(step(5, 0.115).empty());
  EXPECT_TRUE(step(5, 0.125).empty()) << "it was not down";
  EXPECT_TRUE(step(5, 0.109).empty());
  EXPECT_EQ(kinds(step(5, 0.125)), Kinds{EventKind::lifted});
}

TEST_F(LoadHandling, FallenObjectsAreDroppedButPlacedOnesAreNot) {
  step(5, 0);
  step(5, 0.3);
  EXPECT_TRUE(step(0, 0.3, 0.4).empty()) << "slower than the limit";
  const auto events = step(0, 0.29, 0.6);
  ASSERT_EQ(kinds(events), Kinds{EventKind::dropped});
  EXPECT_NEAR(events[0].value, 0.29, 1e-12);
  EXPECT_TRUE(step(0, 0.2, 1.5).empty());
  for (int i = 0; i < 240; ++i) EXPECT_TRUE(step(0, 0).empty());
  // Put down gently: no further events.
  step(5, 0);
  step(5, 0.3);
  step(5, 0.001);
  for (int i = 0; i < 240; ++i) EXPECT_TRUE(step(0, 0).empty());
}

TEST_F(LoadHandling, ASlippingObjectIsDroppedDespiteContact) {
  step(5, 0);
  step(5, 0.3);
  slid = 0.039;
  EXPECT_TRUE(step(5, 0.3).empty());
  slid = 0.041;
  EXPECT_EQ(kinds(step(5, 0.3)), Kinds{EventKind::dropped});
  slid = 0.1;
  EXPECT_TRUE(step(0, 0.2, 2).empty()) << "reported once";
}

TEST_F(LoadHandling, AnObjectInAContainerIsPlacedWhenItRests) {
  step(5, 0);
  step(5, 0.3);
  at.over = "tub";
  EXPECT_TRUE(step(0, 0.2, 1).empty()) << "it falls in, it is not dropped";
  at.in = "tub";
  // kReleaseTime until it counts as released, then kRest; contact was lost one step earlier.
  int steps = 1;
  std::vector<Event> events;
  for (; events.empty() && steps < 200; ++steps) events = step(0, 0.015);
  EXPECT_NEAR(steps * kStep, GripperWatch::kReleaseTime + GripperWatch::kRest, 2 * kStep);
  ASSERT_EQ(kinds(events), Kinds{EventKind::placed});
  EXPECT_EQ(events[0].object, "tub");
  EXPECT_EQ(events[0].text, "load");
  EXPECT_TRUE(step(0, 0.015).empty());
}

TEST_F(LoadHandling, AnObjectThatJittersOnTheSpotIsPlacedAndOneThatMovesIsNot) {
  step(5, 0);
  step(5, 0.3);
  at.over = at.in = "tub";
  std::vector<Event> events;
  constexpr double kSinks = 0.1;  // m/s
  for (int i = 0; i < 240; ++i) EXPECT_TRUE(step(0, 0.3 - kSinks * kStep * i, kSinks).empty());
  int steps = 0;
  for (; events.empty() && steps < 200; ++steps) events = step(0, 0.2, steps % 2 == 0 ? 0.05 : -0.05);
  ASSERT_EQ(kinds(events), Kinds{EventKind::placed});
  const double early = GripperWatch::kStill * GripperWatch::kRest / kSinks;
  EXPECT_GT(steps * kStep, GripperWatch::kRest - early);
  EXPECT_LT(steps * kStep, GripperWatch::kRest + 3 * kStep);
}

TEST_F(LoadHandling, AnObjectThatMissesTheContainerIsDropped) {
  step(5, 0);
  step(5, 0.3);
  at.over = "tub";
  EXPECT_TRUE(step(0, 0.25, 1).empty());
  at.over.clear();
  EXPECT_EQ(kinds(step(0, 0.2, 1)), Kinds{EventKind::dropped});
}

TEST_F(LoadHandling, RemovedObjectsAreForgotten) {
  step(5, 0);
  step(5, 0.3);
  there = false;
  EXPECT_TRUE(step(0, 0.3, 2).empty());
  there = true;
  ++at.epoch;
  EXPECT_TRUE(step(0, 0.3, 2).empty());
}

/// The crawler beside a load, and a container within reach of its arm.
class Gripper : public testing::Test {
 protected:
  void start(double pads, AgentKind kind = AgentKind::box, const Eigen::Vector3d& size = {0.08, 0.08, 0.16}) {
    RobotModel model = *shipped("crawler");
    for (RobotLink& link : model.links) {
      if (std::find(model.gripper.begin(), model.gripper.end(), link.name) != model.gripper.end())
        link.friction = pads;
    }
    SimulationOptions options;
    options.robot_models.push_back(std::make_shared<const RobotModel>(model));
    world.emplace(make(floor_of(20), options));
    spawn(*world, articulated("r", "crawler", 0, 0));
    AgentDefinition load = agent("load", kind, 0.80, 0);
    load.size = size;
    if (kind == AgentKind::cable) load.T_map_base = Transform<Map, Base>::planar(1.10, 0, 0);
    spawn(*world, load);
    AgentDefinition tub = agent("tub", AgentKind::container, 0.12, 0.68);
    tub.size = {0.4, 0.3, 0.2};
    spawn(*world, tub);
    world->take_events();
  }
  void joints(const std::map<std::string, double>& positions) {
    Joints command;
    for (const auto& [name, position] : positions) {
      command.names.push_back(name);
      command.positions.push_back(position);
    }
    const Status status = world->joint_command("r", command);
    ASSERT_TRUE(status.ok()) << status.error().message;
  }
  void reach(double ahead, double z, double turned, double wait) {
    joints(crawler_reach(ahead, z, turned));
    run(*world, wait);
  }
  void fingers(double opening, double wait) {
    joints({{"left_finger_joint", opening}});
    run(*world, wait);
  }
  void lift(double grip_at = 0.11) {
    reach(0.68, 0.40, 0, 5);
    reach(0.68, grip_at, 0, 3);
    fingers(0.079, 1.5);
    reach(0.66, 0.50, 0, 4);
  }
  Eigen::Vector3d load() const { return body(*world, "load").T_map_body.translation(); }
  /// Gripper events, in order.
  std::vector<Event> gripper_events() {
    std::vector<Event> found;
    for (const Event& event : world->take_events()) {
      if (event.kind >= EventKind::gripped && event.kind <= EventKind::placed) found.push_back(event);
    }
    return found;
  }
  std::optional<Simulation> world;
};

TEST_F(Gripper, LiftsABoxAndPutsItIntoTheContainer) {
  start(1.1);
  lift();
  EXPECT_GT(load().z(), 0.3);
  reach(0.68, 0.50, 90 * kDegree, 4);
  reach(0.68, 0.30, 90 * kDegree, 2);
  fingers(0.04, 0.5);
  fingers(0, 2);
  reach(0.60, 0.50, 90 * kDegree, 3);
  const Eigen::Vector3d tub = body(*world, "tub").T_map_body.translation();
  EXPECT_LT((load() - tub).head<2>().cwiseAbs().maxCoeff(), 0.15);
  EXPECT_LT(load().z(), 0.15);
  const auto events = gripper_events();
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[0].kind, EventKind::gripped);
  EXPECT_EQ(events[1].kind, EventKind::lifted);
  EXPECT_EQ(events[2].kind, EventKind::placed);
  for (const Event& event : events) {
    EXPECT_EQ(event.subject, "r");
    EXPECT_EQ(event.pair, PairKind::virtual_virtual);
  }
  EXPECT_EQ(events[0].object, "load");
  EXPECT_EQ(events[2].object, "tub");
  EXPECT_EQ(events[2].text, "load");
  reach(0.60, 0.50, 90 * kDegree, 3);
  for (const Event& event : world->take_events())
    EXPECT_NE(event.subject, "load") << "it lies there: " << to_string(event.kind) << " " << event.object;
}

TEST_F(Gripper, AnObjectReleasedInTheAirIsReportedAsDropped) {
  start(1.1);
  lift();
  gripper_events();
  fingers(0, 2);
  const auto events = gripper_events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].kind, EventKind::dropped);
  EXPECT_EQ(events[0].object, "load");
  EXPECT_GT(events[0].value, 0.25);
  EXPECT_LT(load().z(), 0.1);
}

TEST_F(Gripper, SlipperyPadsDropTheObject) {
  start(0.004);  // 70 N on both sides hold 0.56 N; the box weighs 1.2 N
  lift();
  const auto events = gripper_events();
  ASSERT_GE(events.size(), 1U);
  EXPECT_EQ(events.front().kind, EventKind::gripped);
  EXPECT_LT(load().z(), 0.01) << "it stays where it was";
}

TEST_F(Gripper, ACableIsLiftedByItsEndAndDragged) {
  start(1.1, AgentKind::cable, {0.9, 0.03, 0.03});
  lift(0.045);
  const auto place = [&](const char* link) { return body(*world, "load", link).T_map_body.translation(); };
  const Eigen::Vector3d held = place("link_3"), tail = place("link_15");
  EXPECT_GT(held.z(), 0.3);
  EXPECT_LT(place("link_1").z(), held.z() - 0.04) << "the free end hangs";
  EXPECT_NEAR(tail.z(), 0.015, 0.005);
  run(*world, 3);
  EXPECT_LT((place("link_3") - held).norm(), 0.005) << "it is held";
  reach(0.66, 0.50, -60 * kDegree, 4);
  EXPECT_GT(place("link_3").z(), 0.3);
  EXPECT_GT((place("link_15") - tail).norm(), 0.3) << "the tail is dragged along";
  const auto events = gripper_events();
  ASSERT_EQ(events.size(), 1U) << "not lifted: its tail lies on the floor";
  EXPECT_EQ(events[0].kind, EventKind::gripped);
  EXPECT_EQ(events[0].object, "load");
}

}  // namespace
}  // namespace parhelion::simulation
