// Several real robots in one session: each has its own scans, pose and commands, and one's fault is its own.
#include "tests/server/tick/several_robots.hpp"

#include <gtest/gtest.h>

#include "protocols/driving_timing.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using namespace test;

class SeveralRobotsTest : public TickTest {
 protected:
  std::vector<Event> events_of(EventKind kind) {
    std::vector<Event> all = decoded<Event>(channel::kMrEvents);
    std::erase_if(all, [kind](const Event& event) { return event.kind != kind; });
    return all;
  }
  std::vector<std::vector<std::uint8_t>> scans_of(const std::string& robot) {
    return out_[robot_channel(channel::kMrScan, robot)];
  }
  /// A session of `scenario` and `log` in a new state.
  void run(const Scenario& scenario, const std::vector<Message>& log) {
    out_.clear();
    start(two_robots_configuration(scenario));
    feed(log);
  }
};

const std::vector<AgentDefinition> kTwoBarrels{agent("barrel_1", AgentKind::barrel, 0, 0),
                                               agent("barrel_2", AgentKind::barrel, 2.5, -1.5)};

TEST_F(SeveralRobotsTest, EachRobotsScansComeBackOnItsOwnChannel) {
  run(two_robots(kTwoBarrels), two_robots_drive(3));
  EXPECT_EQ(scans_of(kRover1).size(), 30U);
  EXPECT_EQ(scans_of(kRover2).size(), 30U);
  EXPECT_TRUE(out_[channel::kMrScan].empty());
  for (const std::string& robot : {kRover1, kRover2}) {
    std::size_t live = 0;
    for (const ScanInfo& info : decoded<ScanInfo>(robot_channel(channel::kMrScanInfo, robot)))
      live += info.live;
    EXPECT_GT(live, 25U) << robot;
  }
}

/// One session's answer for a robot is what a session of that robot alone gives, with the same agents.
TEST_F(SeveralRobotsTest, AnotherRobotDoesNotChangeARobotsScans) {
  start(configuration(kTwoBarrels));
  feed(drive(3));
  const auto alone = out_[channel::kMrScan];
  run(two_robots(kTwoBarrels), two_robots_drive(3));
  ASSERT_EQ(alone.size(), scans_of(kRover1).size());
  std::size_t different = 0;
  for (std::size_t i = 0; i < alone.size(); ++i) different += alone[i] != scans_of(kRover1)[i];
  EXPECT_EQ(different, 0U);
}

/// In a row: rover_1, rover_2 2 m ahead of it, and a barrel behind rover_2.
struct Row {
  Transform<Map, Base> first = Transform<Map, Base>::planar(-2, 0, 0);
  Transform<Map, Base> second = Transform<Map, Base>::planar(0, 0, 0.4);
  std::vector<Message> log(double duration, const Eigen::Vector3d& size = {0.6, 0.5, 0.5},
                           double second_sigma = 0.01, const Transform<Map, Base>* reported = nullptr) const {
    const Transform<Map, Base> place = reported != nullptr ? *reported : second;
    return by_arrival(
        of_robot(standing(duration, first, [&](double t) { return seen_from(first, t, &second, size); }),
                 kRover1),
        of_robot(standing(
                     duration, place, [&](double t) { return seen_from(second, t); }, second_sigma),
                 kRover2));
  }
};

TEST_F(SeveralRobotsTest, ARobotIsNeverInjectedIntoAnother) {
  run(two_robots({agent("barrel_1", AgentKind::barrel, 0, 1.5)}), Row().log(2));
  const std::size_t middle = 90;
  const auto infos = decoded<ScanInfo>(robot_channel(channel::kMrScanInfo, kRover1));
  const auto scans = decoded<Scan>(robot_channel(channel::kMrScan, kRover1));
  ASSERT_FALSE(scans.empty());
  const Row row;
  const Scan real = seen_from(row.first, 0, &row.second);
  EXPECT_LT(real.ranges[middle], 2);
  EXPECT_EQ(scans.back().ranges[middle], real.ranges[middle]);
  for (const ScanInfo& info : infos) {
    for (const std::string& name : info.agents) EXPECT_EQ(name, "barrel_1");
  }
}

/// The other robot absorbs the beams (no return): its body still hides what is behind it.
TEST_F(SeveralRobotsTest, ABlackRobotHidesTheAgentBehindIt) {
  const Row row;
  const auto blind = [&](double t) {
    Scan scan = seen_from(row.first, t, &row.second);
    for (std::size_t i = 85; i <= 95; ++i) scan.ranges[i] = robot().laser->convention.no_return_sentinel();
    return scan;
  };
  const auto log = by_arrival(
      of_robot(standing(2, row.first, blind), kRover1),
      of_robot(standing(2, row.second, [&](double t) { return seen_from(row.second, t); }), kRover2));
  run(two_robots({agent("barrel_1", AgentKind::barrel, 1.2, 0)}), log);
  const auto scans = decoded<Scan>(robot_channel(channel::kMrScan, kRover1));
  ASSERT_FALSE(scans.empty());
  EXPECT_EQ(scans.back().ranges[90], robot().laser->convention.no_return_sentinel());
}

std::size_t obstacles_seen(const State& state, std::size_t robot) {
  return state.robots[robot].scan.obstacles.size();
}

TEST_F(SeveralRobotsTest, ARobotsReturnsAreExplainedByWhereItStands) {
  run(two_robots(), Row().log(2));
  EXPECT_EQ(obstacles_seen(*state_, 0), 0U);
}

/// The same returns with the robot elsewhere: the check above can fail.
TEST_F(SeveralRobotsTest, ReturnsWhereNoRobotStandsAreAnObstacle) {
  const auto elsewhere = Transform<Map, Base>::planar(3.5, 3, 0);
  run(two_robots(), Row().log(2, {0.6, 0.5, 0.5}, 0.01, &elsewhere));
  EXPECT_GE(obstacles_seen(*state_, 0), 1U);
}

/// A cable mast 0.15 m outside of the outline, and a pose that is 0.3 m off with the sigma to match.
TEST_F(SeveralRobotsTest, ExplainedReturnsAllowForThePosesUncertainty) {
  Row row;
  const auto off = Transform<Map, Base>::planar(0.3, 0.1, 0.4);
  run(two_robots(), row.log(2, {0.9, 0.8, 0.5}, 0.2, &off));
  EXPECT_EQ(obstacles_seen(*state_, 0), 0U);
}

TEST_F(SeveralRobotsTest, AnAgentsLaserSeesEveryRealRobot) {
  AgentDefinition guard = agent("guard", AgentKind::robot, 0, -2);
  guard.T_map_base = Transform<Map, Base>::planar(0, -2, std::numbers::pi / 2);
  guard.laser = "lms-200";
  run(two_robots({guard}), Row().log(2));
  const auto scans = decoded<Scan>("MR_AGENT_guard_SCAN");
  ASSERT_FALSE(scans.empty());
  const Scan& scan = scans.back();
  const auto nearest = *std::min_element(scan.ranges.begin(), scan.ranges.end());
  EXPECT_NEAR(nearest, 1.7, 0.25) << "rover_2 is 2 m ahead";
}

/// Of rover_2 nothing but `kept` arrives after a second.
std::vector<Message> with_fault_of_rover_2(std::vector<Message> log, const std::vector<std::string>& lost) {
  const ArrivalTime after = ArrivalTime::from_utime(kStartUs + 1'000'000);
  std::erase_if(log, [&](const Message& each) {
    return each.arrival > after && std::any_of(lost.begin(), lost.end(), [&](const std::string& canonical) {
             return each.channel == robot_channel(canonical, kRover2);
           });
  });
  return log;
}

TEST_F(SeveralRobotsTest, OneRobotsFaultDegradesThatRobotAlone) {
  run(two_robots(kTwoBarrels), two_robots_drive(4));
  const auto healthy = scans_of(kRover1);
  for (const std::vector<std::string>& lost :
       {std::vector<std::string>{channel::kPoseCov, channel::kOdometry},
        {channel::kScan},
        {channel::kOdometry}}) {
    run(two_robots(kTwoBarrels), with_fault_of_rover_2(two_robots_drive(4), lost));
    EXPECT_EQ(scans_of(kRover1), healthy) << lost.front();
    for (const EventKind kind : {EventKind::localization_lost, EventKind::injection_suspended}) {
      for (const Event& event : events_of(kind)) {
        if (event.stamp <= SimulationTime{(kStartUs + 1'000'000) * 1000}) continue;
        EXPECT_EQ(event.subject, kRover2);
      }
    }
  }
  // The fault is not silent either.
  run(two_robots(kTwoBarrels), with_fault_of_rover_2(two_robots_drive(4), {channel::kScan}));
  const auto suspended = events_of(EventKind::injection_suspended);
  ASSERT_FALSE(suspended.empty());
  EXPECT_EQ(suspended.back().subject, kRover2);
  EXPECT_EQ(suspended.back().text, "no scan for 0.5 s");
}

/// Of rover_2 no odometry arrives for so many seconds.
std::vector<Message> with_gap_of_rover_2(std::vector<Message> log, double seconds) {
  const ArrivalTime from = ArrivalTime::from_utime(kStartUs + 1'000'000);
  std::erase_if(log, [&](const Message& each) {
    return each.channel == robot_channel(channel::kOdometry, kRover2) && each.arrival > from &&
           each.arrival < from + parhelion::seconds(seconds);
  });
  return log;
}

TEST_F(SeveralRobotsTest, AGapOfOdometryIsALossOnlyWhereItLasts) {
  for (const double seconds : {0.65, 1.3}) {
    run(two_robots(kTwoBarrels), with_gap_of_rover_2(two_robots_drive(4), seconds));
    const auto lost = events_of(EventKind::localization_lost);
    EXPECT_EQ(lost.size(), seconds < 1 ? 0U : 1U) << seconds;
    for (const Event& event : lost) EXPECT_EQ(event.subject, kRover2);
  }
}

TEST_F(SeveralRobotsTest, ARobotThatNeverComesIsReportedByName) {
  run(two_robots(), of_robot(drive(2), kRover1));
  std::vector<std::string> missing;
  for (const Event& event : events_of(EventKind::injection_suspended)) {
    if (event.text == "no scan yet") missing.push_back(event.subject);
  }
  EXPECT_NE(std::find(missing.begin(), missing.end(), kRover2), missing.end());
  EXPECT_TRUE(scans_of(kRover2).empty());
}

Message teleop(const std::string& robot, std::int64_t us, const Twist2& twist) {
  return message(robot_channel(channel::kTeleop, robot), us, TwistCommand{SensorTime::from_utime(us), twist});
}

TEST_F(SeveralRobotsTest, EachTrainesCommandsGoToItsRobotAlone) {
  run(two_robots(), two_robots_drive(1));
  feed(teleop(kRover2, kStartUs + 1'000'000, {0.2, 0, 0.1}));
  const auto commands = decoded<TwistCommand>(robot_channel(channel::kMrCmd, kRover2));
  ASSERT_EQ(commands.size(), 1U);
  EXPECT_GT(commands.front().twist.vx, 0);
  EXPECT_TRUE(out_[robot_channel(channel::kMrCmd, kRover1)].empty());
  const auto pressed = events_of(EventKind::dead_man_pressed);
  ASSERT_EQ(pressed.size(), 1U);
  EXPECT_EQ(pressed.front().subject, kRover2);
}

class StopsOfSeveralRobotsTest : public SeveralRobotsTest {
 protected:
  static constexpr std::int64_t kUs = kStartUs + 1'000'000;
  void SetUp() override {
    run(two_robots(), two_robots_drive(1));
    feed({teleop(kRover1, kUs, {0.2, 0, 0}), teleop(kRover2, kUs + 1000, {0.2, 0, 0})});
  }
  void stop(const std::string& robot, bool engaged, std::int64_t us) {
    feed(message(channel::kMrEmergencyStop, us,
                 EmergencyStopCommand{.request = 7, .robot = robot, .engaged = engaged}));
  }
  double last_speed(const std::string& robot) {
    const auto commands = decoded<TwistCommand>(robot_channel(channel::kMrCmd, robot));
    return commands.empty() ? -1 : commands.back().twist.vx;
  }
};

TEST_F(StopsOfSeveralRobotsTest, AnEmergencyStopIsForOneRobot) {
  stop(kRover1, true, kUs + 2000);
  feed({teleop(kRover1, kUs + 3000, {0.2, 0, 0}), teleop(kRover2, kUs + 4000, {0.2, 0, 0})});
  EXPECT_EQ(last_speed(kRover1), 0);
  EXPECT_GT(last_speed(kRover2), 0);
}

TEST_F(StopsOfSeveralRobotsTest, AnEmergencyStopWithoutANameStopsAll) {
  stop("", true, kUs + 2000);
  feed({teleop(kRover1, kUs + 3000, {0.2, 0, 0}), teleop(kRover2, kUs + 4000, {0.2, 0, 0})});
  EXPECT_EQ(last_speed(kRover1), 0);
  EXPECT_EQ(last_speed(kRover2), 0);
}

TEST_F(StopsOfSeveralRobotsTest, AStopIsReleasedForOneRobot) {
  stop("", true, kUs + 2000);
  stop(kRover2, false, kUs + 3000);
  EXPECT_TRUE(state_->robot(kRover1).command.emergency_stop);
  EXPECT_FALSE(state_->robot(kRover2).command.emergency_stop);
}

TEST_F(StopsOfSeveralRobotsTest, ALostConsoleStopsItsRobotAlone) {
  const auto drives = [](const std::string& who, const std::string& robot, std::int64_t us) {
    OperatorStatus status;
    status.stamp = SensorTime::from_utime(us);
    status.name = who;
    status.robot = robot;
    status.state = OperatorStatus::State::drives;
    return message(channel::kOperators, us, status);
  };
  feed({drives("ann", kRover1, kUs + 2000), drives("ben", kRover2, kUs + 3000)});
  for (int i = 1; i <= 15; ++i) {
    const std::int64_t us = kUs + 4000 + i * 100'000;
    feed({teleop(kRover1, us, {0.2, 0, 0}), teleop(kRover2, us + 1, {0.2, 0, 0}),
          drives("ben", kRover2, us + 2)});
  }
  const auto lost = events_of(EventKind::console_lost);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(lost.front().subject, "ann");
  EXPECT_EQ(lost.front().object, kRover1);
}

TEST_F(SeveralRobotsTest, NoAgentMayAppearOnAnyRealRobot) {
  run(two_robots(), two_robots_drive(1));
  const auto spawn = [&](double x, double y, std::uint64_t request) {
    AgentSpawn command;
    command.request = request;
    command.agent = agent("box_" + std::to_string(request), AgentKind::box, x, y);
    feed(message(channel::kMrSpawn, kStartUs + 1'000'000 + static_cast<std::int64_t>(request), command));
  };
  spawn(4, -3, 1);
  spawn(-3, 2, 2);
  const auto refused = events_of(EventKind::command_refused);
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_EQ(refused.front().request, 1U);
}

TEST(SeveralRobotsConfiguration, TheSessionHeaderKeepsEveryDescription) {
  Scenario scenario = two_robots(kTwoBarrels);
  RobotDescription heavy = robot();
  heavy.mass = 120;
  const auto made = configure_robots(scenario, std::vector<RobotDescription>{robot(), heavy}, room());
  ASSERT_TRUE(made.ok());
  const auto back = configuration_from(session_header(*made, {}), "log");
  ASSERT_TRUE(back.ok()) << back.error().message;
  ASSERT_EQ(back->robot_count(), 2U);
  EXPECT_EQ(back->robot_at(0).name, kRover1);
  EXPECT_EQ(back->robot_at(1).name, kRover2);
  EXPECT_EQ(back->robot_at(1).mass, 120);
}

TEST(SeveralRobotsConfiguration, ADescriptionIsNeededForEachRobot) {
  const auto made = configure_robots(two_robots(), std::vector<RobotDescription>{robot()}, room());
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("1 robot descriptions for 2 robots"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::tick
