// People in the scans of a real robot become persons of the simulation, after the answer; nothing of them is
// injected.
#include "server/tick/people_path.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

/// Range from the laser to a leg (a cylinder of 7 cm radius) along a beam; infinity beside it.
double leg_range(const Eigen::Vector2d& eye, double angle, const Eigen::Vector2d& leg) {
  const Eigen::Vector2d d(std::cos(angle), std::sin(angle)), f = leg - eye;
  const double along = f.dot(d), off2 = f.squaredNorm() - along * along;
  constexpr double r2 = 0.07 * 0.07;
  return along > 0 && off2 < r2 ? along - std::sqrt(r2 - off2) : std::numeric_limits<double>::infinity();
}

/// Somebody walks along x = 2.5 from y = -3 to 3 at 1 m/s.
Eigen::Vector2d walker_at(double t) { return {-1.5, -2.5 + std::fmod(0.9 * t, 5.0)}; }

std::vector<Message> drive_past_a_walker(double duration) {
  std::vector<Message> log = test::drive(duration);
  const LaserDescription laser = *test::robot().laser;
  for (Message& each : log) {
    if (each.channel != channel::kScan) continue;
    Scan scan;
    EXPECT_TRUE(decode(each.channel, each.payload, scan).ok());
    const double t = static_cast<double>(scan.stamp.utime() - test::kStartUs) * 1e-6;
    const auto T = test::pose_at(t) * laser.T_base_laser;
    const Eigen::Vector2d eye = T.translation().head<2>();
    const double swing = 0.25 * std::sin(2 * std::numbers::pi * 0.8 * t);
    for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
      const double angle = T.yaw() + scan.angle_min + static_cast<double>(i) * scan.angle_increment;
      for (const double side : {-1.0, 1.0}) {
        const Eigen::Vector2d leg = walker_at(t) + Eigen::Vector2d(0.1 * side, swing * side);
        scan.ranges[i] = std::min(scan.ranges[i], static_cast<float>(leg_range(eye, angle, leg)));
      }
    }
    each = test::message(channel::kScan, each.arrival.utime(), scan);
  }
  return log;
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
    for (const simulation::RealPerson& person : state_->robots.front().people.persons) {
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
  PeopleState& people = state_->robots.front().people;
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

TEST_F(PeoplePath, a_person_is_no_anonymous_obstacle) {
  start(test::configuration({}));
  for (const Message& each : drive_past_a_walker(10)) {
    feed(each);
    const RobotState& robot = state_->robots.front();
    for (const simulation::RealPerson& person : robot.people.persons) {
      if (robot.people.seen != robot.scan.obstacles_seen) continue;
      for (const simulation::RealObstacle& obstacle : robot.scan.obstacles)
        EXPECT_GE((obstacle.center - person.position).norm(), 0.4);
    }
  }
}

}  // namespace
}  // namespace parhelion::tick
