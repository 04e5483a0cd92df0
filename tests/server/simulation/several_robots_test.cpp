// Several real robots in one world: contacts, near misses and poses that cannot both be right.
#include <gtest/gtest.h>

#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

using States = std::vector<std::optional<RealRobotState>>;

Simulation make_robots(std::size_t count, const SemanticModel& model = {}) {
  std::vector<RobotDescription> robots(count, robot());
  for (std::size_t i = 0; i < count; ++i) robots[i].name = "rover_" + std::to_string(i + 1);
  auto made = Simulation::create({}, model, robots, kStart);
  EXPECT_TRUE(made.ok()) << (made ? "" : made.error().message);
  return std::move(*made);
}

RealRobotState known(RealRobotState state, double sigma = 0.01) {
  state.sigma = sigma;
  return state;
}

/// rover_1 drives along x at `speed` from `from` to `to`; rover_2 stands at the origin.
std::vector<Event> drive_towards(Simulation& simulation, double from, double to, double speed, double y = 0,
                                 double sigma = 0.01) {
  std::vector<LaserRequest> requests;
  const int steps = static_cast<int>(std::abs(to - from) / speed * 240);
  for (int i = 0; i <= steps; ++i) {
    const double x = from + (to - from) * i / steps;
    simulation.step_robots(States{known(real_at(x, y, 0, {to > from ? speed : -speed, 0, 0}), sigma),
                                  known(real_at(0, 0), sigma)},
                           requests);
  }
  return simulation.take_events();
}

double half_length() {
  double half = 0;
  for (const auto& corner : robot().footprint) half = std::max(half, std::abs(corner.x()));
  return half;
}

TEST(SeveralRobots, ARobotThatDrivesIntoAnotherIsTheSubjectOfTheContact) {
  Simulation simulation = make_robots(2);
  const double touch = -2 * half_length();
  auto events = drive_towards(simulation, touch - 1, touch, 0.5);
  const auto started = only(events, EventKind::contact_started);
  ASSERT_EQ(started.size(), 1U);
  EXPECT_EQ(started.front().subject, "rover_1");
  EXPECT_EQ(started.front().object, "rover_2");
  EXPECT_EQ(started.front().pair, PairKind::real_real);
  EXPECT_FALSE(started.front().undetectable);
  EXPECT_NEAR(started.front().impulse, robot().mass / 2 * 0.5, 1.0) << "the reduced mass times closing speed";
  EXPECT_NEAR(started.front().position.x(), -half_length(), 0.05);
  events = drive_towards(simulation, touch, touch - 1, 0.5);
  EXPECT_EQ(only(events, EventKind::contact_ended).size(), 1U);
  EXPECT_TRUE(only(events, EventKind::poses_conflict).empty());
}

TEST(SeveralRobots, ACollisionAheadIsPredictedForTheRobotThatDrives) {
  Simulation simulation = make_robots(2);
  const auto events = drive_towards(simulation, -2 * half_length() - 2, -2 * half_length() - 0.3, 0.5);
  const auto predicted = only(events, EventKind::collision_predicted);
  ASSERT_FALSE(predicted.empty());
  EXPECT_EQ(predicted.front().subject, "rover_1");
  EXPECT_EQ(predicted.front().object, "rover_2");
  EXPECT_EQ(predicted.front().pair, PairKind::real_real);
}

TEST(SeveralRobots, PassingCloselyIsANearMissAndFarOffIsNothing) {
  double half_width = 0;
  for (const auto& corner : robot().footprint) half_width = std::max(half_width, std::abs(corner.y()));
  for (const double gap : {0.12, 1.0}) {
    Simulation simulation = make_robots(2);
    auto events = drive_towards(simulation, -2, 2, 0.5, 2 * half_width + gap);
    std::vector<LaserRequest> requests;
    for (int i = 0; i < 240; ++i)
      simulation.step_robots(States{known(real_at(2, 2 * half_width + gap)), known(real_at(0, 0))}, requests);
    const auto rest = simulation.take_events();
    events.insert(events.end(), rest.begin(), rest.end());
    const auto missed = only(events, EventKind::near_miss);
    EXPECT_TRUE(only(events, EventKind::contact_started).empty()) << gap;
    ASSERT_EQ(missed.size(), gap < 0.2 ? 1U : 0U) << gap;
    if (missed.empty()) continue;
    EXPECT_EQ(missed.front().subject, "rover_1");
    EXPECT_EQ(missed.front().object, "rover_2");
    EXPECT_NEAR(missed.front().value, gap, 0.02);
  }
}

TEST(SeveralRobots, TwoPosesInOnePlaceAreAConflictAndNoContact) {
  Simulation simulation = make_robots(2);
  std::vector<LaserRequest> requests;
  for (int i = 0; i < 480; ++i)
    simulation.step_robots(States{known(real_at(1, 1)), known(real_at(1.05, 1))}, requests);
  const auto events = simulation.take_events();
  const auto conflicts = only(events, EventKind::poses_conflict);
  ASSERT_EQ(conflicts.size(), 1U) << "reported once";
  EXPECT_EQ(conflicts.front().subject, "rover_1");
  EXPECT_EQ(conflicts.front().object, "rover_2");
  EXPECT_GT(conflicts.front().value, 0.1);
  EXPECT_NE(conflicts.front().text.find("localization"), std::string::npos);
  EXPECT_TRUE(only(events, EventKind::contact_started).empty());
}

TEST(SeveralRobots, AnOverlapWithinThePosesUncertaintyIsNoConflict) {
  Simulation simulation = make_robots(2);
  std::vector<LaserRequest> requests;
  const double overlap = 0.25;
  for (int i = 0; i < 240; ++i)
    simulation.step_robots(
        States{known(real_at(0, 0), 0.1), known(real_at(2 * half_length() - overlap, 0), 0.1)}, requests);
  EXPECT_TRUE(only(simulation.take_events(), EventKind::poses_conflict).empty());
}

TEST(SeveralRobots, AConflictIsReportedAgainAfterItWasResolved) {
  Simulation simulation = make_robots(2);
  std::vector<LaserRequest> requests;
  const auto steps = [&](double x) {
    for (int i = 0; i < 480; ++i)
      simulation.step_robots(States{known(real_at(0, 0)), known(real_at(x, 0))}, requests);
  };
  steps(0);
  steps(5);
  steps(0);
  EXPECT_EQ(only(simulation.take_events(), EventKind::poses_conflict).size(), 2U);
}

/// An agent that one robot's sensors do not show freezes near that robot, not near the other.
TEST(SeveralRobots, AnAgentIsWithheldFromOneRobotAlone) {
  Simulation simulation = make_robots(2);
  const States states{known(real_at(-5, 0)), known(real_at(5, 0))};
  ASSERT_TRUE(
      simulation.spawn_among_robots(moving("walker", AgentKind::person, 4, 2, BehaviourKind::wander), states)
          .ok());
  const auto moved = [&](std::size_t withheld_from) {
    simulation.show("walker", AgentShown::shown, 1 - withheld_from);
    simulation.show("walker", AgentShown::withheld, withheld_from);
    std::vector<LaserRequest> requests;
    for (int i = 0; i < 120; ++i) simulation.step_robots(states, requests);  // until it has stopped
    const Eigen::Vector3d before = simulation.pose_of("walker")->translation();
    for (int i = 0; i < 240; ++i) simulation.step_robots(states, requests);
    return (simulation.pose_of("walker")->translation() - before).norm();
  };
  EXPECT_GT(moved(0), 0.1) << "rover_1 is 9 m away";
  EXPECT_LT(moved(1), 0.05) << "rover_2 stands beside it";
}

TEST(SeveralRobots, ARobotWithoutAPoseLeavesTheOthersInTheWorld) {
  Simulation simulation = make_robots(3);
  std::vector<LaserRequest> requests;
  for (int i = 0; i < 24; ++i)
    simulation.step_robots(States{known(real_at(-3, 0)), std::nullopt, known(real_at(3, 0))}, requests);
  WorldSnapshot world;
  ASSERT_TRUE(simulation.at(simulation.now(), world));
  std::vector<std::string> present;
  for_each_body(world, [&](const BodyDefinition& body, const BodyState&) { present.push_back(body.entity); });
  EXPECT_EQ(present, (std::vector<std::string>{"rover_1", "rover_3"}));
}

TEST(SeveralRobots, TwoRobotsOfOneNameAreRefused) {
  const auto made = Simulation::create({}, {}, std::vector<RobotDescription>(2, robot()), kStart);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("two robots are called '" + robot().name + "'"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::simulation
