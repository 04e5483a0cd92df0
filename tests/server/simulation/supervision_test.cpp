#include <numbers>

#include "server/simulation/bodies/watches.hpp"
#include "server/simulation/events/contacts.hpp"
#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

/// Warnings that come before have tests of their own.
std::vector<Event> as_they_happen(std::vector<Event> events) {
  std::erase_if(events, [](const Event& event) { return event.kind == EventKind::tipping_predicted; });
  return events;
}

Simulation with_limits(const SimulationOptions& options = {}, const SemanticModel& model = {}) {
  RobotDescription description = robot();
  description.attitude = AttitudeLimits{};
  auto simulation = Simulation::create(options, model, description, kStart);
  EXPECT_TRUE(simulation.ok());
  return std::move(simulation).value();
}

RealRobotState tilted(double roll, double pitch) {
  RealRobotState state = real_at(0, 0);
  state.T_map_base =
      Transform<Map, Base>(Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                               Eigen::Quaterniond(Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX())),
                           {0, 0, 0});
  state.attitude_known = true;
  return state;
}

TEST(Supervision, MovementStartsAtOnceAndStopsAfterAPause) {
  Simulation simulation = make();
  // Trapezoid: faster than 0.05 m/s from 1.1 s, slower than 0.02 m/s from 3.96 s on.
  const auto events = follow(simulation, 6, [](double t) {
    const double v = std::clamp(std::min((t - 1) * 0.5, (4 - t) * 0.5), 0.0, 1.0);
    return real_at(0, 0, 0, {v, 0, 0});
  });
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].kind, EventKind::movement_started);
  EXPECT_NEAR(since_start(events[0]), 1.1, 1.001 * kStep);
  EXPECT_EQ(events[1].kind, EventKind::movement_stopped);
  EXPECT_NEAR(since_start(events[1]), 3.96 + MovementWatch::kPause, 1.001 * kStep);
}

TEST(Supervision, AReversalIsNotReportedAsAStop) {
  Simulation simulation = make();
  const auto events = follow(simulation, 4, [](double t) { return real_at(0, 0, 0, {2 - t, 0, 0}); });
  EXPECT_EQ(events.size(), 1U);
}

TEST(Supervision, PitchAndRollAreReportedOncePerWarningAndLimit) {
  Simulation simulation = with_limits();
  const double top = 0.65, rate = 0.5;  // rad, rad/s: up and down, twice
  const auto events = as_they_happen(follow(simulation, 5.2, [&](double t) {
    const double phase = std::fmod(t, 2 * top / rate);
    return tilted(0, std::min(phase, 2 * top / rate - phase) * rate);
  }));
  ASSERT_EQ(events.size(), 4U);
  EXPECT_EQ(events[0].kind, EventKind::pitch_warning);
  EXPECT_NEAR(since_start(events[0]), 0.35 / rate, 1.001 * kStep);
  EXPECT_NEAR(events[0].value, 0.35, rate * kStep);
  EXPECT_EQ(events[1].kind, EventKind::pitch_limit);
  EXPECT_NEAR(since_start(events[1]), 0.6 / rate, 1.001 * kStep);
  EXPECT_NEAR(since_start(events[2]), (2 * top + 0.35) / rate, 1.001 * kStep);
}

TEST(Supervision, ARollToTheRightIsPositive) {
  Simulation simulation = with_limits();
  const auto events = as_they_happen(follow(simulation, 1, [](double t) { return tilted(0.55 * t, 0); }));
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].kind, EventKind::roll_warning);
  EXPECT_EQ(events[1].kind, EventKind::roll_limit);
  EXPECT_GT(events[1].value, 0.5);
}

TEST(Supervision, WithoutAnInertialSensorAttitudeIsNotReported) {
  Simulation simulation = with_limits();
  const auto events = follow(simulation, 4, [](double t) {
    RealRobotState state = tilted(t, 0);
    state.attitude_known = false;
    return state;
  });
  EXPECT_TRUE(events.empty());
}

TEST(Supervision, ATippedOverRobotIsReportedOnce) {
  Simulation simulation = make();
  const auto events =
      follow(simulation, 2, [](double t) { return tilted(std::min(t, std::numbers::pi / 2), 0); });
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].kind, EventKind::tipped_over);
  EXPECT_NEAR(since_start(events[0]), std::numbers::pi / 3, 1.001 * kStep);
}

TEST(Supervision, YawRateNeedsNoInertialSensor) {
  Simulation simulation = with_limits();
  auto events = follow(simulation, 3, [](double t) { return real_at(0, 0, 0, {0, 0, -t}); });
  events.erase(events.begin());  // that it moves
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].kind, EventKind::yaw_rate_warning);
  EXPECT_NEAR(since_start(events[0]), 1.5, 1.001 * kStep);
  EXPECT_LT(events[0].value, -1.5);
  EXPECT_EQ(events[1].kind, EventKind::yaw_rate_limit);
  EXPECT_NEAR(since_start(events[1]), 2.5, 1.001 * kStep);
}

TEST(Supervision, ZonesAreEnteredAndLeftWithHysteresis) {
  SimulationOptions options;
  options.zones = {{"danger", {{1, -1}, {2, -1}, {2, 1}, {1, 1}}, 0, 2},
                   {"above", {{1, -1}, {2, -1}, {2, 1}}, 3, 4}};
  Simulation simulation = make({}, options);
  auto events = follow(simulation, 3, [](double t) { return real_at(t, 0, 0, {1, 0, 0}); });
  events.erase(events.begin());
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].kind, EventKind::zone_entered);
  EXPECT_EQ(events[0].object, "danger");
  EXPECT_NEAR(since_start(events[0]), 1, 1.001 * kStep);
  EXPECT_EQ(events[1].kind, EventKind::zone_left);
  EXPECT_NEAR(since_start(events[1]), 2 + ZoneWatch::kEdge, 1.001 * kStep);
}

TEST(Supervision, ARobotWithoutAPoseHasLeftItsZones) {
  SimulationOptions options;
  options.zones = {{"all", {{-9, -9}, {9, -9}, {9, 9}, {-9, 9}}}};
  Simulation simulation = make({}, options);
  run(simulation, 0.1, real_at(0, 0, 0, {1, 0, 0}));
  run(simulation, 0.1);
  run(simulation, 0.1, real_at(0, 0, 0, {1, 0, 0}));
  const auto events = simulation.take_events();
  EXPECT_EQ(count(events, EventKind::zone_entered), 2U);
  EXPECT_EQ(count(events, EventKind::zone_left), 1U);
  EXPECT_EQ(count(events, EventKind::movement_stopped), 1U);
}

TEST(Supervision, AZoneWithoutAreaIsRefused) {
  SimulationOptions options;
  options.zones = {{"line", {{0, 0}, {1, 0}, {2, 0}}}};
  const auto simulation = Simulation::create(options, {}, robot(), kStart);
  ASSERT_FALSE(simulation.ok());
  EXPECT_NE(simulation.error().message.find("'line'"), std::string::npos);
}

/// Five steps of 0.17 m, 0.3 m deep, starting at x = 1 m.
SemanticModel flight() {
  SemanticModel model;
  model.entities.push_back(model_box("floor", EntityLabel::floor, {0, 0, -0.05}, {20, 20, 0.1}));
  for (int i = 0; i < 5; ++i) {
    const double top = 0.17 * (i + 1);
    model.entities.push_back(model_box("step " + std::to_string(i + 1), EntityLabel::stairs,
                                       {1.15 + 0.3 * i, 0, top / 2}, {0.3, 2, top}));
    model.entities.back().part_of = "stairs 1";
  }
  return model;
}

TEST(Supervision, EachClimbedStepIsReportedWithItsName) {
  Simulation simulation = make(flight());
  // base_link moves on the line of the nosings, up, down and up again.
  const auto on_stairs = [](double x) {
    RealRobotState state = real_at(x, 0);
    state.T_map_base = Transform<Map, Base>::planar(x, 0, 0, std::max(0.0, 0.17 + (x - 1) * 0.17 / 0.3));
    return state;
  };
  const auto events = only(
      follow(simulation, 7.2, [&](double t) { return on_stairs(t < 2.4   ? t
                                                               : t < 4.8 ? 4.8 - t
                                                                         : t - 4.8); }),
      EventKind::step_climbed);
  ASSERT_EQ(events.size(), 10U);
  for (int i = 0; i < 10; ++i) {
    const auto& event = events[static_cast<std::size_t>(i)];
    EXPECT_EQ(event.object, "step " + std::to_string(i % 5 + 1));
    EXPECT_EQ(event.text, "of stairs 1");
    EXPECT_NEAR(event.value, 0.17 * (i % 5 + 1), 1e-9);
    EXPECT_NEAR(since_start(event), (i < 5 ? 1.0 : 5.8) + 0.3 * (i % 5), 1.001 * kStep);
  }
}

TEST(Supervision, SwayingOnAStepsEdgeIsOneClimb) {
  Simulation simulation = make(flight());
  const auto events = follow(simulation, 3, [](double t) {
    RealRobotState state = real_at(0, 0);
    state.T_map_base = Transform<Map, Base>::planar(1 - 0.03 * std::cos(10 * t), 0, 0, 0.17);
    return state;
  });
  EXPECT_EQ(count(events, EventKind::step_climbed), 1U);
}

TEST(Supervision, ABoxPushedOffATableIsReportedAsFallen) {
  SemanticModel model;
  model.entities.push_back(model_box("floor", EntityLabel::floor, {0, 0, -0.05}, {20, 20, 0.1}));
  FallWatch watch;
  Supervised body;
  body.name = "crate";
  body.low = {-0.2, -0.2, 0};
  body.high = {0.2, 0.2, 0.4};
  std::vector<Event> events;
  const double height = 0.8, g = 9.81, release = 0.5;
  const double lands = release + std::sqrt(2 * height / g);
  for (int i = 1; i < 480; ++i) {
    const double t = i * kStep, fallen = t < release ? 0 : g * (t - release) * (t - release) / 2;
    ObservedMotion motion;
    motion.stamp = kStart + seconds(t);
    motion.T_map_base = Transform<Map, Base>::planar(0, 0, 0, std::max(0.0, height - fallen));
    watch.update(body, motion, kStep, events);
  }
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].kind, EventKind::fell);
  EXPECT_NEAR(since_start(events[0]), lands, 2 * kStep);
  EXPECT_NEAR(events[0].value, height, 0.01);
}

TEST(Supervision, ARobotTiltingOverAnEdgeIsNotReportedAsFallen) {
  FallWatch watch;
  Supervised body;
  body.low = {-0.4, -0.3, 0};
  body.high = {0.4, 0.3, 0.4};
  std::vector<Event> events;
  for (int i = 1; i < 240; ++i) {  // rotates about the middle of its underside, 30 degrees in 0.1 s
    ObservedMotion motion;
    motion.T_map_base = Transform<Map, Base>(
        Eigen::Quaterniond(Eigen::AngleAxisd(std::min(0.5, 5 * i * kStep), Eigen::Vector3d::UnitY())),
        {0, 0, 1});
    watch.update(body, motion, kStep, events);
  }
  EXPECT_TRUE(events.empty());
}

TEST(Supervision, AContinuingContactIsReportedEverySecond) {
  Simulation simulation = make(room(6));
  std::vector<LaserRequest> requests;
  for (int i = 0; i < 5 * 240; ++i) {
    RealRobotState real = real_at(2.76, 0, 0, {0.5, 0, 0});
    real.sigma = 0.01;
    simulation.step(real, requests);
  }
  const auto events = simulation.take_events();
  ASSERT_EQ(count(events, EventKind::contact_started), 1U);
  const auto goes_on = only(events, EventKind::contact_continues);
  ASSERT_EQ(goes_on.size(), 4U);
  EXPECT_NEAR(goes_on[2].value, 3, 1e-9);
  EXPECT_NEAR(goes_on[2].impulse, 40 * 0.5, 0.5);
}

TEST(Supervision, ARestingContactIsNotReportedUntilItMovesAgain) {
  ContactTracker contacts;
  std::vector<Event> events;
  TouchingPair pair{"part_1", "tub_1"};
  for (int i = 0; i < 6 * 240; ++i) {
    pair.rests = i > 60 && i < 5 * 240;
    contacts.update({pair}, kStart + seconds(i * kStep), events);
  }
  ASSERT_EQ(events.size(), 2U) << "of six seconds it lay there for almost five";
  EXPECT_EQ(events[0].kind, EventKind::contact_started);
  EXPECT_EQ(events[1].kind, EventKind::contact_continues);
  EXPECT_NEAR(since_start(events[1]), 5, 2 * kStep);
}

TEST(Supervision, RemovingAnAgentEndsItsReportedMovement) {
  Simulation simulation = make();
  spawn(simulation, moving("walker", AgentKind::person, 0, 0, BehaviourKind::wander));
  run(simulation, 3);
  ASSERT_TRUE(simulation.command(AgentRemove{.agent = "walker"}, std::nullopt).ok());
  const auto events = simulation.take_events();
  EXPECT_EQ(count(events, EventKind::movement_started), count(events, EventKind::movement_stopped));
  EXPECT_GE(count(events, EventKind::movement_started), 1U);
}

}  // namespace
}  // namespace parhelion::simulation
