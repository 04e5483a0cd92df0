// An agent at the limit of pose uncertainty does not flicker, and returns outside the stopping distance.
#include "server/tick/injection_gate.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "server/tick/state.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::tick {
namespace {

class InjectionGateTest : public testing::Test {
 protected:
  InjectionGateTest() {
    real_.emplace();
    real_->T_map_base = Transform<Map, Base>::planar(-3, 0, 0);
    kStep();
  }
  /// A scan every tenth of a second, with the physics steps before it.
  bool scan(double error) {
    const bool shown = gate_.admit("box_1", error, state_->simulation.now() - microseconds(100), limits_,
                                   state_->simulation);
    for (int i = 0; i < 24; ++i) kStep();
    return shown;
  }
  void kStep() { state_->simulation.step(real_, requests_); }
  double distance() {
    WorldSnapshot world;
    EXPECT_TRUE(state_->simulation.at(state_->simulation.now(), world));
    double distance = std::numeric_limits<double>::quiet_NaN();
    for_each_body(world, [&](const BodyDefinition& definition, const BodyState& body) {
      if (definition.entity == "box_1")
        distance = (body.T_map_body.translation() - real_->T_map_base.translation()).norm();
    });
    return distance;
  }

  const Configuration configuration_ = test::configuration({test::agent("box_1", AgentKind::box, 3, 0)});
  std::unique_ptr<State> state_ = *make_state(configuration_, ArrivalTime::from_utime(test::kStartUs));
  std::optional<simulation::RealRobotState> real_;
  std::vector<simulation::LaserRequest> requests_;
  InjectionLimits limits_;  // 0.10 m, restored below 0.08 m
  InjectionGate gate_;
};

TEST_F(InjectionGateTest, GateShowsAnAgentUpToTheLimit) {
  EXPECT_TRUE(scan(0.0));
  EXPECT_TRUE(scan(0.1));
  EXPECT_FALSE(scan(0.1001));
}

TEST_F(InjectionGateTest, GateHasHysteresisAtTheLimit) {
  int changes = 0;
  bool before = true;
  for (int i = 0; i < 200; ++i) {
    const bool shown = scan(0.10 + 0.015 * std::sin(0.7 * i));
    changes += shown != before ? 1 : 0;
    before = shown;
  }
  EXPECT_EQ(changes, 1) << "it goes, and does not come back while the error stays about the limit";
  EXPECT_FALSE(scan(0.081));
  EXPECT_FALSE(scan(0.079)) << "first the simulation makes room";
  EXPECT_TRUE(scan(0.095)) << "back, it stays up to the limit";
}

TEST_F(InjectionGateTest, GateTreatsNaNErrorAsTooLarge) {
  EXPECT_FALSE(scan(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(scan(std::numeric_limits<double>::infinity()));
  EXPECT_FALSE(scan(0.01));
  EXPECT_FALSE(scan(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(scan(0.01));
  EXPECT_TRUE(scan(0.01));
}

TEST_F(InjectionGateTest, GateReshowsAgentsOnlyInLaterMeasurements) {
  EXPECT_FALSE(scan(0.2));
  const SimulationTime asked = state_->simulation.now();
  EXPECT_FALSE(scan(0.01));
  EXPECT_FALSE(gate_.admit("box_1", 0.01, asked, limits_, state_->simulation)) << "it was measured before";
  EXPECT_TRUE(gate_.admit("box_1", 0.01, asked + microseconds(1), limits_, state_->simulation));
}

TEST_F(InjectionGateTest, NoAgentComesBackInsideTheStoppingDistance) {
  EXPECT_FALSE(scan(0.2));
  EXPECT_NEAR(distance(), 6, 0.1) << "while it is hidden it stays where it is";
  real_->T_map_base = Transform<Map, Base>::planar(1.9, 0, 0);
  real_->twist = {1.0, 0, 0};  // drives on towards the withheld agent
  EXPECT_FALSE(scan(0.09));
  EXPECT_NEAR(distance(), 1.1, 0.1);
  const RobotLimits limits = configuration_.robot.limits;
  const double braking_distance = limits.reaction_time + 1 / (2 * limits.deceleration);
  ASSERT_GT(braking_distance, 0.5) << "the place where it stands is inside";
  EXPECT_FALSE(scan(0.05));
  EXPECT_TRUE(scan(0.05));
  bool moved = false;
  for (const Event& event : state_->simulation.take_events())
    moved = moved || (event.kind == EventKind::agent_moved && event.subject == "box_1");
  EXPECT_TRUE(moved) << "and reports it";
  const auto clear = state_->simulation.clearance(real_->T_map_base, real_->twist, 10);
  EXPECT_GT(clear.distance, braking_distance) << "the robot can stop before it";
}

RC_GTEST_FIXTURE_PROP(InjectionGateTest, GateNeverShowsAboveTheLimitNorReshowsAtIt, ()) {
  const auto errors = *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 30));
  bool shown = true, was_clearly_below = true;
  for (const int hundredths : errors) {
    const double error = 0.01 * hundredths / 1.5;
    const bool now =
        gate_.admit("box_1", error, state_->simulation.now() + microseconds(1), limits_, state_->simulation);
    kStep();
    if (now) RC_ASSERT(error <= 0.10);
    if (now && !shown) RC_ASSERT(was_clearly_below);
    if (shown && !now) was_clearly_below = false;
    if (error <= 0.08) was_clearly_below = true;
    shown = now;
  }
}

}  // namespace
}  // namespace parhelion::tick
