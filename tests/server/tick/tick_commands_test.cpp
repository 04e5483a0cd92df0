// How the tick processes commands: the instructor's, the trainee's, and an emergency stop (promise 3).
#include <gtest/gtest.h>

#include <random>

#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using test::agent;
using test::TickTest;

TEST_F(TickTest, TickPublishesAnEventForEachAgentCommand) {
  start(test::configuration({}));
  feed(test::drive(2));
  AgentSpawn command{.request = 42, .agent = agent("box_1", AgentKind::box, 3, 2)};
  feed(test::message(channel::kMrSpawn, test::kStartUs + 2'000'000, command));
  command.request = 43;  // the same name again
  feed(test::message(channel::kMrSpawn, test::kStartUs + 2'000'100, command));
  command.request = 44;  // unreadable
  command.agent.name = "box/2";
  feed(test::message(channel::kMrSpawn, test::kStartUs + 2'000'200, command));
  feed(test::message(channel::kMrFreeze, test::kStartUs + 2'000'300,  // on the channel of another type
                     AgentRemove{.request = 45, .agent = "box_1"}));
  std::map<std::uint64_t, EventKind> answers;
  std::map<std::uint64_t, std::string> reasons;
  for (const Event& event : decoded<Event>(channel::kMrEvents)) {
    if (event.request == 0) continue;
    answers[event.request] = event.kind;
    reasons[event.request] = event.text;
  }
  EXPECT_EQ(answers[42], EventKind::command_accepted);
  EXPECT_EQ(answers[43], EventKind::command_refused);
  EXPECT_EQ(answers[44], EventKind::command_refused);
  EXPECT_NE(reasons[44].find("name"), std::string::npos) << reasons[44];
  EXPECT_FALSE(answers.contains(45)) << "unreadable";
  EXPECT_TRUE(state_->simulation.pose_of("box_1"));
}

TEST_F(TickTest, TickRefusesAgentsOnTheRealRobotAndSuggestsPlaces) {
  start(test::configuration({}));
  feed(test::drive(2));
  const auto here = test::pose_at(2).translation();
  const AgentSpawn command{.request = 1, .agent = agent("box_1", AgentKind::box, here.x(), here.y())};
  feed(test::message(channel::kMrSpawn, test::kStartUs + 2'000'000, command));
  const auto events = decoded<Event>(channel::kMrEvents);
  const auto answer =
      std::find_if(events.begin(), events.end(), [](const Event& e) { return e.request == 1; });
  ASSERT_NE(answer, events.end());
  EXPECT_EQ(answer->kind, EventKind::command_refused);
  EXPECT_NE(answer->text.find_first_of("0123456789"), std::string::npos) << answer->text;
}

TEST_F(TickTest, TickOnlyEverReducesTheTraineesCommand) {
  start(test::configuration({agent("box_1", AgentKind::box, 1.5, 1.6)}));
  std::mt19937 random(11);
  std::uniform_real_distribution<double> component(-1.5, 1.5);
  auto log = test::drive(10);
  std::vector<TwistCommand> asked;
  for (int i = 0; i < 190; ++i) {
    TwistCommand command;
    const std::int64_t utime = test::kStartUs + 50'000 * i + 11'000;
    command.stamp = SensorTime::from_utime(utime);
    command.twist = {component(random), 0, component(random)};
    log.push_back(test::message(channel::kTeleop, utime, command));
  }
  std::stable_sort(log.begin(), log.end(),
                   [](const auto& a, const auto& b) { return a.arrival < b.arrival; });
  int reduced = 0;
  for (const Message& each : log) {
    out_.clear();
    feed(each);
    if (each.channel != channel::kTeleop) continue;
    TwistCommand command;
    ASSERT_TRUE(decode(each.channel, each.payload, command).ok());
    const auto given = decoded<TwistCommand>(channel::kMrCmd);
    ASSERT_EQ(given.size(), 1U);
    const Twist2 &in = command.twist, &out = given[0].twist;
    ASSERT_LE(std::abs(out.vx), std::abs(in.vx) + 1e-9);
    ASSERT_LE(std::abs(out.wz), std::abs(in.wz) + 1e-9);
    ASSERT_GE(out.vx * in.vx, 0);
    ASSERT_NEAR(out.vx * in.wz, out.wz * in.vx, 1e-6) << "a curve stays the same curve";
    reduced += std::abs(out.vx) < std::abs(in.vx) - 1e-6 ? 1 : 0;
  }
  EXPECT_GT(reduced, 0) << "the box stands on the way";
}

TEST_F(TickTest, TickStopsTheRobotOnTeleopTimeout) {
  start(test::configuration({}));
  auto log = test::drive(4);
  TwistCommand command;
  command.stamp = SensorTime::from_utime(test::kStartUs + 1'000'000);
  command.twist = {0.5, 0, 0};
  log.push_back(test::message(channel::kTeleop, test::kStartUs + 1'000'000, command));
  std::stable_sort(log.begin(), log.end(),
                   [](const auto& a, const auto& b) { return a.arrival < b.arrival; });
  feed(log);
  const auto given = decoded<TwistCommand>(channel::kMrCmd);
  ASSERT_GE(given.size(), 2U);
  EXPECT_EQ(given.back().twist.vx, 0);
  EXPECT_EQ(given.back().twist.wz, 0);
}

TEST_F(TickTest, TickNamesARobotWhosePoseWasNeverKnownAndLetsItCrawl) {
  start(test::configuration({}));
  for (std::int64_t us = test::kStartUs; us < test::kStartUs + 1'500'000; us += 50'000) {
    const double asked = us == test::kStartUs ? 0 : 0.5;  // the dead-man is pressed after the start
    feed(test::message(channel::kTeleop, us, TwistCommand{SensorTime::from_utime(us), {asked, 0, 0}}));
    advance_to(ArrivalTime::from_utime(us + 10'000));
  }
  const auto worlds = decoded<WorldMessage>(channel::kMrWorld);
  ASSERT_FALSE(worlds.empty());
  for (const WorldMessage& world : worlds) EXPECT_EQ(world.robot, configuration_.robot.name);
  const auto given = decoded<TwistCommand>(channel::kMrCmd);
  ASSERT_FALSE(given.empty());
  EXPECT_NEAR(given.back().twist.vx, configuration_.scenario.contact.crawl_speed, 1e-6);
}

/// A robot in emergency stop stands, whatever is commanded, until the stop is released and the dead-man was
/// released.
TEST_F(TickTest, TickHoldsAnEmergencyStopAgainstAnyDriver) {
  start(test::configuration({}));
  auto log = test::drive(8);
  const auto add = [&](double s, double vx) {
    const std::int64_t utime = test::kStartUs + static_cast<std::int64_t>(s * 1e6) + 7;
    log.push_back(
        test::message(channel::kTeleop, utime, TwistCommand{SensorTime::from_utime(utime), {vx, 0, 0}}));
  };
  const auto order = [&](double s, bool engaged, std::uint64_t request) {
    const std::int64_t utime = test::kStartUs + static_cast<std::int64_t>(s * 1e6);
    const EmergencyStopCommand command{SensorTime::from_utime(utime), request, configuration_.robot.name,
                                       engaged};
    log.push_back(test::message(channel::kMrEmergencyStop, utime, command));
  };
  for (int i = 20; i < 60; ++i) add(0.1 * i, 0.3);  // a stick held all the time
  add(6.0, 0);
  for (int i = 61; i < 70; ++i) add(0.1 * i, 0.3);
  order(3, true, 7);
  order(5, false, 8);
  std::stable_sort(log.begin(), log.end(),
                   [](const auto& a, const auto& b) { return a.arrival < b.arrival; });
  double moved[4] = {};  // before, during the stop, until the dead-man is released, afterwards
  for (const Message& each : log) {
    out_.clear();
    feed(each);
    const double s = (each.arrival.utime() - test::kStartUs) * 1e-6;
    const int part = s < 3 ? 0 : s < 5 ? 1 : s < 6 ? 2 : 3;
    for (const TwistCommand& command : decoded<TwistCommand>(channel::kMrCmd))
      moved[part] = std::max(moved[part], std::abs(command.twist.vx));
    for (const Event& event : decoded<Event>(channel::kMrEvents)) {
      if (event.request == 7 || event.request == 8) {
        EXPECT_EQ(event.kind, EventKind::command_accepted);
      }
    }
  }
  EXPECT_GT(moved[0], 0);
  EXPECT_EQ(moved[1], 0);
  EXPECT_EQ(moved[2], 0) << "held through the stop: it must be let go first";
  EXPECT_GT(moved[3], 0);
}

TEST_F(TickTest, TickRepeatsAnEmergencyStopForARobotThatDrivesItself) {
  start(test::configuration({}));
  auto log = test::drive(5);
  for (const bool engaged : {true, false}) {
    const std::int64_t utime = test::kStartUs + (engaged ? 2'000'000 : 4'000'000);
    log.push_back(test::message(channel::kMrEmergencyStop, utime,
                                EmergencyStopCommand{SensorTime::from_utime(utime), engaged ? 7U : 8U,
                                                     configuration_.robot.name, engaged}));
  }
  std::stable_sort(log.begin(), log.end(),
                   [](const auto& a, const auto& b) { return a.arrival < b.arrival; });
  int stops[3] = {};  // before, during the stop, afterwards
  for (const Message& each : log) {
    out_.clear();
    feed(each);
    const double s = (each.arrival.utime() - test::kStartUs) * 1e-6;
    for (const TwistCommand& command : decoded<TwistCommand>(channel::kMrCmd)) {
      ++stops[s < 2 ? 0 : s < 4 ? 1 : 2];
      EXPECT_TRUE(command.twist.vx == 0 && command.twist.vy == 0 && command.twist.wz == 0);
    }
  }
  EXPECT_EQ(stops[0], 0);
  EXPECT_GE(stops[1], 15) << "each 0.1 s";
  EXPECT_EQ(stops[2], 0);
}

TEST_F(TickTest, TickFreezesAgentsButNotTheTraineesRobot) {
  start(test::configuration({agent("robot_1", AgentKind::robot, 3, 2)}));
  feed(test::drive(1));
  std::int64_t utime = test::kStartUs + 1'000'000;
  const auto answer = [&](const char* channel, const auto& command) {
    out_.clear();
    feed(test::message(channel, utime += 100, command));
    const auto events = decoded<Event>(channel::kMrEvents);
    return events.empty() ? "no answer" : events.back().text;
  };
  const std::string robot = configuration_.robot.name;
  EXPECT_NE(answer(channel::kMrFreeze, AgentFreeze{.request = 1, .agent = robot}).find("MR_EMERGENCY_STOP"),
            std::string::npos);
  EXPECT_FALSE(state_->robots.front().command.emergency_stop);
  EXPECT_EQ(answer(channel::kMrEmergencyStop, EmergencyStopCommand{.request = 2, .robot = "robot_1"}), "");
  EXPECT_FALSE(state_->robots.front().command.emergency_stop) << "that was an agent";
  EXPECT_NE(answer(channel::kMrEmergencyStop, EmergencyStopCommand{.request = 3, .robot = "nobody"}), "");
  EXPECT_EQ(answer(channel::kMrEmergencyStop, EmergencyStopCommand{.request = 4}), "");
  EXPECT_TRUE(state_->robots.front().command.emergency_stop) << "every robot of a trainee";
  EXPECT_EQ(answer(channel::kMrFreeze, AgentFreeze{.request = 5, .all = true, .frozen = false}), "");
  EXPECT_TRUE(state_->robots.front().command.emergency_stop);
}

/// A session may run for days, and agents come and go.
TEST_F(TickTest, TickForgetsTheKindsOfRemovedAgents) {
  start(test::configuration({agent("barrel_1", AgentKind::barrel, 3, 2)}));
  std::int64_t us = test::kStartUs;
  const std::size_t before = state_->world.kinds.size();
  std::size_t max_count = 0;
  for (int i = 0; i < 100; ++i) {
    const std::string name = "box_" + std::to_string(i);
    feed(test::message(channel::kMrSpawn, us += 10, AgentSpawn{.agent = agent(name, AgentKind::box, 3, -2)}));
    ASSERT_TRUE(state_->simulation.find_agent(name)) << i;
    feed(test::message(channel::kMrRemove, us += 10, AgentRemove{.agent = name}));
    max_count = std::max(max_count, state_->world.kinds.size());
    ASSERT_FALSE(state_->world.kinds.contains(name));
  }
  EXPECT_LE(max_count, before + 1);
  EXPECT_EQ(state_->world.kinds.at("barrel_1"), AgentKind::barrel);
}

}  // namespace
}  // namespace parhelion::tick
