// Real people whom sensors follow: agents keep clear of them, robots brake before them, contacts are events.
#include "server/simulation/bodies/real_people.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/simulation/worlds.hpp"

namespace parhelion::simulation {
namespace {

using test::make;
using test::moving;
using test::only;
using test::spawn;
using testing::HasSubstr;

RealPerson person(double x, double y, SimulationTime stamp, const Eigen::Vector2d& velocity = {0, 0}) {
  return {7, {x, y}, velocity, 0.25, stamp};
}

TEST(RealPeople, a_driven_robot_stops_before_a_person_and_goes_on_when_the_way_is_free) {
  Simulation simulation = make(test::room(12));
  spawn(simulation, moving("rover", AgentKind::robot, 0, 0, BehaviourKind::teleop, 1.0));
  double gap = 10;
  for (int i = 0; i < 50; ++i) {
    simulation.set_real_people({person(3, 0, simulation.now())});
    test::drive(simulation, "rover", {1.0, 0, 0}, 0.1);
    gap = std::min(gap, 3 - 0.25 - test::body(simulation, "rover").T_map_body.translation().x());
  }
  EXPECT_TRUE(only(simulation.take_events(), EventKind::contact_started).empty());
  const double stopped_at = test::body(simulation, "rover").T_map_body.translation().x();
  EXPECT_GT(gap, 0.25);
  EXPECT_GT(stopped_at, 1.5);  // it went as near as it may
  EXPECT_LT(test::body(simulation, "rover").velocity.norm(), 0.05);
  simulation.set_real_people({});
  test::drive(simulation, "rover", {1.0, 0, 0}, 2);
  EXPECT_GT(test::body(simulation, "rover").T_map_body.translation().x(), stopped_at + 1);
}

TEST(RealPeople, a_driven_robot_may_pass_by_and_drive_away) {
  Simulation simulation = make(test::room(12));
  spawn(simulation, moving("rover", AgentKind::robot, 0, 0, BehaviourKind::teleop, 1.0));
  for (int i = 0; i < 30; ++i) {
    simulation.set_real_people({person(2, 1.5, simulation.now()), person(-0.9, 0, simulation.now())});
    test::drive(simulation, "rover", {1.0, 0, 0}, 0.1);
  }
  EXPECT_GT(test::body(simulation, "rover").T_map_body.translation().x(), 2);
}

TEST(RealPeople, a_person_who_walks_into_a_standing_robot_is_a_contact_that_never_scores) {
  Simulation simulation = make(test::room(12));
  spawn(simulation, test::agent("crate", AgentKind::box, 0, 0));
  std::vector<Event> events;
  for (int i = 0; i < 30; ++i) {
    simulation.set_real_people({person(2 - 0.1 * i, 0, simulation.now(), {-1, 0})});
    test::run(simulation, 0.1);
  }
  for (const Event& event : simulation.take_events()) events.push_back(event);
  const auto started = only(events, EventKind::contact_started);
  ASSERT_EQ(started.size(), 1U);
  EXPECT_EQ(started[0].subject, "crate");
  EXPECT_EQ(started[0].object, "real person 7");
  EXPECT_EQ(started[0].pair, PairKind::real_virtual);
  EXPECT_TRUE(started[0].undetectable);
  EXPECT_EQ(only(events, EventKind::contact_ended).size(), 1U);
}

TEST(RealPeople, whoever_steps_in_front_of_a_driving_robot_is_a_contact) {
  Simulation simulation = make(test::room(12));
  spawn(simulation, moving("rover", AgentKind::robot, 0, 0, BehaviourKind::teleop, 1.0));
  test::drive(simulation, "rover", {1.0, 0, 0}, 2);
  const double x = test::body(simulation, "rover").T_map_body.translation().x();
  simulation.set_real_people({person(x + 0.4, 0, simulation.now())});
  test::drive(simulation, "rover", {1.0, 0, 0}, 0.1);
  const auto started = only(simulation.take_events(), EventKind::contact_started);
  ASSERT_EQ(started.size(), 1U);
  EXPECT_FALSE(started[0].undetectable);
}

TEST(RealPeople, agents_keep_clear_of_somebody_who_crosses_their_path) {
  Simulation simulation = make(test::room(12));
  AgentDefinition guard = moving("guard", AgentKind::robot, -4, 0, BehaviourKind::patrol, 0.8);
  guard.behaviour.waypoints = {{4, 0}, {-4, 0}};
  spawn(simulation, guard);
  double farthest = -10;
  for (int i = 0; i < 400; ++i) {
    const double t = 0.1 * i, y = 3 * std::sin(0.25 * t);
    simulation.set_real_people({person(0, y, simulation.now(), {0, 0.75 * std::cos(0.25 * t)})});
    test::run(simulation, 0.1);
    farthest = std::max(farthest, test::body(simulation, "guard").T_map_body.translation().x());
  }
  for (const Event& event : only(simulation.take_events(), EventKind::contact_started))
    EXPECT_TRUE(event.undetectable) << event.subject << " drove into " << event.object;
  EXPECT_GT(farthest, 3.0);
}

TEST(RealPeople, a_person_is_a_body_of_the_world_that_may_never_be_injected) {
  Simulation simulation = make(test::room(12));
  spawn(simulation, moving("guide", AgentKind::person, -3, -3, BehaviourKind::wander));
  const auto version = simulation.scene()->version;
  simulation.set_real_people({person(2, 1, simulation.now(), {0, 0.8})});
  EXPECT_GT(simulation.scene()->version, version);
  test::run(simulation, 0.1);
  WorldSnapshot world;
  ASSERT_TRUE(simulation.at(simulation.now(), world));
  int found = 0;
  for_each_body(world, [&](const BodyDefinition& body, const BodyState& state) {
    if (body.owner != BodyOwner::real_person) return;
    ++found;
    EXPECT_EQ(body.entity, "real person 7");
    EXPECT_FALSE(body.injectable);
    EXPECT_FALSE(body.shapes.empty());
    EXPECT_NEAR(state.T_map_body.translation().y(), 1.08, 0.01) << "he walks on";
    EXPECT_NEAR(state.T_map_body.yaw(), std::numbers::pi / 2, 1e-6);
    EXPECT_NEAR(state.velocity.y(), 0.8, 1e-9);
  });
  EXPECT_EQ(found, 1);
  simulation.set_real_people({});
  test::run(simulation, 0.1);
  EXPECT_FALSE(test::has_body(simulation, simulation.now(), "real person 7"));
}

TEST(RealPeople, a_person_keeps_the_body_as_long_as_the_identity) {
  Simulation simulation = make(test::room(12));
  simulation.set_real_people({person(2, 1, simulation.now())});
  test::run(simulation, 0.1);
  const auto version = simulation.scene()->version;
  simulation.set_real_people({person(2.1, 1, simulation.now())});
  EXPECT_EQ(simulation.scene()->version, version);
}

TEST(RealPeople, driving_into_a_person_is_an_event_of_its_own) {
  Simulation simulation = make(test::room(12));
  spawn(simulation, moving("rover", AgentKind::robot, 0, 0, BehaviourKind::teleop, 1.0));
  test::drive(simulation, "rover", {1.0, 0, 0}, 2);
  const double x = test::body(simulation, "rover").T_map_body.translation().x();
  simulation.set_real_people({person(x + 0.4, 0, simulation.now())});
  test::drive(simulation, "rover", {1.0, 0, 0}, 0.5);
  const auto touched = only(simulation.take_events(), EventKind::person_touched);
  ASSERT_EQ(touched.size(), 1U) << "once a contact";
  EXPECT_EQ(touched[0].subject, "rover");
  EXPECT_EQ(touched[0].object, "real person 7");
  EXPECT_GT(touched[0].value, 0.3);
  EXPECT_GT(touched[0].impulse, 5);
}

/// The real robot drives at 0.5 m/s towards somebody at x = 2.
std::vector<Event> drive_at_a_person(double until, double speed, double sigma) {
  Simulation simulation = make(test::room(12));
  const auto start = simulation.now();
  simulation.set_real_people({person(2, 0, start)});
  return test::follow(simulation, until, [&](double t) {
    auto state = test::real_at(speed > 0 ? speed * t : 1.7, 0, 0, {speed, 0, 0});
    state.sigma = sigma;
    return state;
  });
}

TEST(RealPeople, the_real_robot_that_drives_into_a_person_is_to_blame) {
  const auto events = drive_at_a_person(3.5, 0.5, 0.02);
  const auto touched = only(events, EventKind::person_touched);
  ASSERT_EQ(touched.size(), 1U);
  EXPECT_EQ(touched[0].subject, "pioneer");
  EXPECT_EQ(touched[0].pair, PairKind::real_real);
  EXPECT_NEAR(touched[0].value, 0.5, 0.01);
  EXPECT_NEAR(touched[0].impulse, 20, 1);
  EXPECT_EQ(only(events, EventKind::contact_started).size(), 1U);
}

TEST(RealPeople, a_robot_that_stands_or_stops_in_time_touched_nobody) {
  EXPECT_TRUE(only(drive_at_a_person(2.9, 0.5, 0.02), EventKind::person_touched).empty());
  const auto standing = drive_at_a_person(1, 0, 0.02);
  EXPECT_TRUE(only(standing, EventKind::person_touched).empty());
  const auto contact = only(standing, EventKind::contact_started);
  ASSERT_EQ(contact.size(), 1U);
  EXPECT_TRUE(contact[0].undetectable);
}

TEST(RealPeople, nobody_is_blamed_for_an_overlap_within_the_poses_uncertainty) {
  EXPECT_TRUE(only(drive_at_a_person(3.2, 0.5, 0.2), EventKind::person_touched).empty());
}

TEST(RealPeople, a_robot_that_drives_away_is_not_to_blame) {
  Simulation simulation = make(test::room(12));
  simulation.set_real_people({person(-0.35, 0, simulation.now())});
  const auto events = test::follow(simulation, 0.3, [](double t) {
    return test::real_at(0.4 * t, 0, 0, {0.4, 0, 0});
  });
  EXPECT_TRUE(only(events, EventKind::person_touched).empty());
}

TEST(RealPeople, nothing_appears_on_a_person) {
  Simulation simulation = make(test::room(12));
  simulation.set_real_people({person(2, 2, simulation.now())});
  test::run(simulation, 0.1);
  const Status status = simulation.spawn(test::agent("crate", AgentKind::box, 2, 2), std::nullopt);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("on a real person"));
}

}  // namespace
}  // namespace parhelion::simulation
