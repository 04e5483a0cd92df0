// Near misses: reported once no contact is possible any more, with the geometrically correct distance.
#include "server/simulation/bodies/near_miss.hpp"

#include <algorithm>

#include "robots_world.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

constexpr double kOutlineAhead = 0.25, kSide = 0.2;  // m, of the robot's outline

template <class Motion>
std::vector<Event> near_misses(Simulation& simulation, double duration, Motion robot_at) {
  return only(follow(simulation, duration, robot_at), EventKind::near_miss);
}

/// A cube of half a metre.
AgentDefinition crate(double x, double y) {
  AgentDefinition box = agent("crate", AgentKind::box, x, y);
  box.size = {0.5, 0.5, 0.5};
  return box;
}

/// Passes a crate at (2, 0) at `speed`, with a lateral gap.
std::vector<Event> pass(double gap, double speed, bool injection_live = true) {
  Simulation simulation = make();
  spawn(simulation, crate(2, 0));
  const double y = -(0.25 + gap + kSide);
  return near_misses(simulation, 4 / speed, [=](double t) {
    RealRobotState real = real_at(speed * t, y, 0, {speed, 0, 0});
    real.injection_live = injection_live;
    return real;
  });
}

TEST(NearMiss, ANearMissIsReportedAfterPassingWithItsSmallestGap) {
  const auto misses = pass(0.12, 0.5);
  ASSERT_EQ(misses.size(), 1U);
  EXPECT_EQ(misses[0].subject, "pioneer");
  EXPECT_EQ(misses[0].object, "crate");
  EXPECT_EQ(misses[0].pair, PairKind::real_virtual);
  EXPECT_EQ(misses[0].text, "gap");
  EXPECT_NEAR(misses[0].value, 0.12, 1e-3);
  EXPECT_NEAR(misses[0].position.y(), -0.25, 1e-6);
  EXPECT_FALSE(misses[0].undetectable);
  // Distance along x when its rear corner is kAway from the crate's.
  const double along = std::sqrt(NearMissWatch::kAway * NearMissWatch::kAway - 0.12 * 0.12);
  const double over = (2 + 0.25 + along + kOutlineAhead) / 0.5 + NearMissWatch::kHold;
  EXPECT_NEAR((misses[0].stamp - kStart).seconds(), over, 0.04);
}

TEST(NearMiss, KeepingDistanceOrPassingSlowlyIsNoNearMiss) {
  EXPECT_TRUE(pass(0.22, 0.5).empty());
  EXPECT_TRUE(pass(0.05, 0.09).empty());
}

TEST(NearMiss, UnsensedNearMissesAreFlagged) {
  const auto misses = pass(0.1, 0.5, false);
  ASSERT_EQ(misses.size(), 1U);
  EXPECT_TRUE(misses[0].undetectable);
}

TEST(NearMiss, StoppingLateBeforeAWallIsANearMissByTime) {
  // Braking at 2 m/s^2 from 1 m/s, to a stop 0.35 m before the wall: before it brakes the time decreases
  // monotonically.
  Simulation simulation = make(room(6));
  const double brakes = 1.5, v = 1, a = 2;
  const auto misses = near_misses(simulation, brakes + v / a + 2, [=](double t) {
    const double slow = std::clamp(t - brakes, 0.0, v / a);
    const double x0 = 3 - kOutlineAhead - 0.35 - v * v / (2 * a) - v * brakes;
    const double x = x0 + v * std::min(t, brakes) + v * slow - a * slow * slow / 2;
    return real_at(x, 0, 0, {v - a * slow, 0, 0});
  });
  ASSERT_EQ(misses.size(), 1U);
  EXPECT_EQ(misses[0].object, "wall 1");
  EXPECT_EQ(misses[0].pair, PairKind::real_real);
  EXPECT_EQ(misses[0].text, "time");
  // The minimum of distance over speed: where 0.35 + s^2 / (2 a) = gap, at s = sqrt(2 a 0.35) or at the start
  // of braking.
  const double s = std::min(v, std::sqrt(2 * a * 0.35));
  EXPECT_NEAR(misses[0].value, (0.35 + s * s / (2 * a)) / s, 0.03);
}

TEST(NearMiss, StoppingTooNearIsReportedForBuildingsAndObjects) {
  for (const bool building : {true, false}) {
    Simulation simulation = make(building ? room(6) : SemanticModel{});
    if (!building) spawn(simulation, crate(3.25, 0));
    const auto misses = near_misses(simulation, 3, [](double t) {
      const double at = 3 - kOutlineAhead - 0.08;
      return real_at(at - 0.5 * std::max(0.0, 2 - t), 0, 0, {t < 2 ? 0.5 : 0.0, 0, 0});
    });
    const auto by = [&](const std::string& text) {
      return std::find_if(misses.begin(), misses.end(), [&](const Event& miss) { return miss.text == text; });
    };
    ASSERT_EQ(misses.size(), 2U) << building;
    ASSERT_NE(by("gap"), misses.end());
    ASSERT_NE(by("time"), misses.end());
    EXPECT_NEAR(by("gap")->value, 0.08, 0.005);
    EXPECT_NEAR(by("time")->value, 0.16, 0.01);
    EXPECT_NEAR((by("gap")->stamp - kStart).seconds(), 2 + NearMissWatch::kHold, 0.01);
  }
}

TEST(NearMiss, ContactOrDrivingAwayIsNoNearMiss) {
  Simulation simulation = make(room(6));
  const auto misses = near_misses(simulation, 6, [](double t) {
    const double at = 3 - kOutlineAhead + 0.005;  // more than it drives in a step
    if (t < 2) return real_at(at - 0.5 * (2 - t), 0, 0, {0.5, 0, 0});
    if (t < 3) return real_at(at, 0);
    return real_at(at - 0.5 * (t - 3), 0, 0, {-0.5, 0, 0});
  });
  EXPECT_TRUE(misses.empty());
}

TEST(NearMiss, StartingBesideAWallIsNoNearMiss) {
  Simulation simulation = make(room(6));
  const auto misses = near_misses(simulation, 4, [](double t) {
    if (t < 1) return real_at(0, 3 - kSide - 0.1);
    return real_at(0, 3 - kSide - 0.1 - 0.5 * (t - 1), 0, {0, -0.5, 0});
  });
  EXPECT_TRUE(misses.empty());
}

TEST(NearMiss, TheSubjectIsTheMovingRobot) {
  Simulation simulation = make({}, with_robots({"rover"}));
  spawn(simulation, articulated("r", "rover", -2, 0.6));
  drive(simulation, "r", {0.5, 0, 0}, 8, real_at(0, 0));
  const auto misses = only(simulation.take_events(), EventKind::near_miss);
  ASSERT_EQ(misses.size(), 1U);
  EXPECT_EQ(misses[0].subject, "r");
  EXPECT_EQ(misses[0].object, "pioneer");
  EXPECT_EQ(misses[0].text, "gap");
  EXPECT_GT(misses[0].value, 0);
}

}  // namespace
}  // namespace parhelion::simulation
