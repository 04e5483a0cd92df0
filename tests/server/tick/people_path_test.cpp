// People in the scans of a real robot become persons of the simulation, after the answer; nothing of them is
// injected.
#include "server/tick/people_path.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/server/tick/several_robots.hpp"
#include "tests/server/tick/tick_fixture.hpp"
#include "tests/server/tick/walker.hpp"

namespace parhelion::tick {
namespace {

/// Somebody walks along x = -1.5 from y = -2.5 to 2.5 at 0.9 m/s, again and again.
Eigen::Vector2d walker_at(double t) { return {-1.5, -2.5 + std::fmod(0.9 * t, 5.0)}; }

std::vector<Message> drive_past_a_walker(double duration) {
  return test::drive_past_a_walker(duration, walker_at);
}

using PeoplePath = test::TickTest;

TEST_F(PeoplePath, follows_a_walker_and_publishes_scans_unchanged) {
  start(test::configuration({}));
  int seen = 0;
  std::uint32_t id = 0, changes = 0;
  double worst = 0;
  for (const Message& each : drive_past_a_walker(10)) {
    feed(each);
    if (each.channel != channel::kScan) continue;
    const double t = static_cast<double>(each.arrival.utime() - 5000 - test::kStartUs) * 1e-6;
    for (const simulation::RealPerson& person : state_->bystanders.persons) {
      const double off = (person.position - walker_at(t)).norm();
      if (off > 0.5) continue;
      ++seen;
      worst = std::max(worst, off);
      changes += person.id != id ? 1 : 0;
      id = person.id;
    }
  }
  EXPECT_GE(seen, 15);
  EXPECT_LE(changes, 2U);
  std::vector<Scan> in, out = decoded<Scan>(channel::kMrScan);
  for (const Message& each : drive_past_a_walker(10)) {
    if (each.channel != channel::kScan) continue;
    in.emplace_back();
    ASSERT_TRUE(decode(each.channel, each.payload, in.back()).ok());
  }
  ASSERT_EQ(in.size(), out.size());
  for (std::size_t i = 0; i < in.size(); ++i) EXPECT_EQ(in[i].ranges, out[i].ranges);
}

TEST_F(PeoplePath, forgets_people_where_no_scan_arrives) {
  start(test::configuration({}));
  Bystanders& people = state_->bystanders;
  ArrivalTime last{};
  for (const Message& each : drive_past_a_walker(10)) {
    feed(each);
    last = each.arrival;
    if (!people.persons.empty()) break;
  }
  ASSERT_FALSE(people.persons.empty());
  advance_to({last.ns + seconds(1.2).ns});
  EXPECT_TRUE(people.persons.empty());
}

TEST_F(PeoplePath, a_walker_is_in_the_world_apart_from_virtual_persons) {
  start(test::configuration({test::agent("guide", AgentKind::person, 3, 3)}));
  for (const Message& each : drive_past_a_walker(10)) feed(each);
  std::size_t seen = 0;
  for (const WorldMessage& world : decoded<WorldMessage>(channel::kMrWorld)) {
    std::size_t bodies = 0;
    for (const WorldMessage::Entry& body : world.bodies) {
      if (body.owner != BodyOwner::real_person) continue;
      ++bodies;
      EXPECT_EQ(body.kind, AgentKind::person);
      EXPECT_TRUE(body.entity.starts_with("real person "));
    }
    ASSERT_EQ(world.persons.size(), bodies);
    seen += bodies;
    for (const WorldMessage::Person& person : world.persons) {
      EXPECT_GT(person.covariance(0, 0), 1e-6);
      EXPECT_GE(person.radius, 0.2);
      EXPECT_LE(SimulationTime{world.stamp.ns} - person.seen, seconds(3));
    }
  }
  EXPECT_GT(seen, 60U);
}

/// The scan is of the empty room, the people are only believed: whatever is injected must be theirs.
TEST_F(PeoplePath, nobody_who_is_believed_to_be_there_gets_into_a_scan) {
  start(test::configuration({}));
  std::vector<simulation::RealPerson> everywhere;
  std::size_t scans = 0;
  for (Message& each : test::drive(3)) {
    everywhere.clear();
    for (std::uint32_t i = 0; i < 12; ++i) {
      const double angle = 2 * std::numbers::pi * i / 12;
      everywhere.push_back(
          {i + 1, {1.2 * std::cos(angle), 1.2 * std::sin(angle)}, {0.3, 0}, 0.3, state_->simulation.now()});
    }
    state_->simulation.set_real_people(everywhere);
    feed(each);
    if (each.channel != channel::kScan) continue;
    ++scans;
    ASSERT_EQ(out_[channel::kMrScan].size(), scans);
    EXPECT_EQ(out_[channel::kMrScan].back(), each.payload) << scans;
  }
  EXPECT_GE(scans, 30U);
  for (const ScanInfo& info : decoded<ScanInfo>(channel::kMrScanInfo)) EXPECT_TRUE(info.agents.empty());
}

TEST_F(PeoplePath, an_agents_laser_sees_a_real_person) {
  AgentDefinition guard = test::agent("guard", AgentKind::robot, 0, -2);
  guard.laser = "lms-200";
  const auto nearest = [&](bool with_person) {
    out_.clear();
    start(test::configuration({guard}));
    for (const Message& each : test::drive(1)) {
      if (with_person)
        state_->simulation.set_real_people({{4, {1.5, -2}, {0, 0}, 0.25, state_->simulation.now()}});
      feed(each);
    }
    const auto scans = decoded<Scan>("MR_AGENT_guard_SCAN");
    EXPECT_FALSE(scans.empty());
    if (scans.empty()) return 0.0F;
    const auto ahead =
        scans.back().ranges.begin() + static_cast<std::ptrdiff_t>(scans.back().ranges.size() / 2);
    return *std::min_element(ahead - 10, ahead + 10);  // between the legs it looks through
  };
  const float with = nearest(true), without = nearest(false);
  EXPECT_NEAR(with, 1.2, 0.2) << "the laser is 0.2 m ahead, the leg's front 0.1 m before the middle";
  EXPECT_GT(without, with + 1);
}

TEST_F(PeoplePath, a_person_is_no_anonymous_obstacle) {
  start(test::configuration({}));
  for (const Message& each : drive_past_a_walker(10)) {
    feed(each);
    const RobotState& robot = state_->robots.front();
    for (const simulation::RealPerson& person : state_->bystanders.persons) {
      if (robot.people.seen != robot.scan.obstacles_seen) continue;
      for (const simulation::RealObstacle& obstacle : robot.scan.obstacles)
        EXPECT_GE((obstacle.center - person.position).norm(), 0.4);
    }
  }
}

/// Two robots face each other from x = -3 and x = 3, and somebody walks between them; each robot sees him
/// where `sees(robot, t)`.
template <class Walk, class Sees>
std::vector<Message> between_two_robots(double duration, Walk walk, Sees sees, double second_x = 3) {
  const auto first = Transform<Map, Base>::planar(-3, 0, 0);
  const auto second = Transform<Map, Base>::planar(3, 0, std::numbers::pi);
  const auto scans = [=](std::size_t robot, const Transform<Map, Base>& T_map_base) {
    return [=](double t) {
      Scan scan = test::seen_from(T_map_base, t);
      if (sees(robot, t)) test::put_walker(walk(t), t, T_map_base * test::robot().laser->T_base_laser, scan);
      return scan;
    };
  };
  const auto reported = Transform<Map, Base>::planar(second_x, 0, std::numbers::pi);
  return test::by_arrival(
      test::of_robot(test::standing(duration, first, scans(0, first)), test::kRover1),
      test::of_robot(test::standing(duration, reported, scans(1, second)), test::kRover2));
}

/// Identities near the walker, and the max persons there at once, over a session.
struct WhoWasThere {
  std::set<std::uint32_t> ids;
  std::size_t max = 0, seen = 0;
};

class PeopleOfSeveralRobots : public test::TickTest {
 protected:
  template <class Walk>
  WhoWasThere run(const std::vector<Message>& log, Walk walk) {
    start(test::two_robots_configuration(test::two_robots()));
    WhoWasThere all;
    for (const Message& each : log) {
      feed(each);
      if (!each.channel.starts_with(channel::kScan)) continue;
      const double t = static_cast<double>(each.arrival.utime() - 5000 - test::kStartUs) * 1e-6;
      std::size_t now = 0;
      for (const simulation::RealPerson& person : state_->bystanders.persons) {
        if ((person.position - walk(t)).norm() > 0.7) continue;
        all.ids.insert(person.id);
        ++now;
      }
      all.seen += now > 0 ? 1 : 0;
      all.max = std::max(all.max, now);
    }
    return all;
  }
};

TEST_F(PeopleOfSeveralRobots, one_person_seen_by_both_is_one) {
  const auto walk = [](double t) { return Eigen::Vector2d(0, -2 + 0.5 * t); };
  const auto both = [](std::size_t, double) { return true; };
  const WhoWasThere who = run(between_two_robots(8, walk, both), walk);
  EXPECT_GT(who.seen, 100U);
  EXPECT_EQ(who.max, 1U);
  EXPECT_EQ(who.ids.size(), 1U);
}

TEST_F(PeopleOfSeveralRobots, an_identity_is_kept_from_one_robots_view_to_the_others) {
  const auto walk = [](double t) { return Eigen::Vector2d(-1.8 + 0.45 * t, 0.4); };
  const auto in_turn = [](std::size_t robot, double t) { return robot == 0 ? t < 4.2 : t > 3.4; };
  const WhoWasThere who = run(between_two_robots(8, walk, in_turn), walk);
  EXPECT_GT(who.seen, 100U);
  EXPECT_EQ(who.max, 1U);
  EXPECT_EQ(who.ids.size(), 1U);
}

/// rover_2 on two posts that look and move like legs.
TEST_F(PeopleOfSeveralRobots, another_robot_is_nobody) {
  const auto walk = [](double) { return Eigen::Vector2d(2.95, 0); };
  const auto first_only = [](std::size_t robot, double) { return robot == 0; };
  EXPECT_EQ(run(between_two_robots(6, walk, first_only), walk).seen, 0U);
  EXPECT_TRUE(state_->robots.front().scan.obstacles.empty());
}

/// The same with rover_2 elsewhere: the check above can fail.
TEST_F(PeopleOfSeveralRobots, where_no_robot_stands_the_same_returns_are_somebody) {
  const auto walk = [](double t) { return Eigen::Vector2d(2.0 - 0.3 * t, 0.3); };
  const auto first_only = [](std::size_t robot, double) { return robot == 0; };
  EXPECT_GT(run(between_two_robots(6, walk, first_only), walk).seen, 20U);
}

}  // namespace
}  // namespace parhelion::tick
