// Real people whom sensors follow: agents keep clear of them, robots brake before them, contacts are events.
#include "server/simulation/real_people.hpp"

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
  EXPECT_EQ(started[0].object, "person_7");
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
