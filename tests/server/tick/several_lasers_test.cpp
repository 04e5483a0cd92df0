// Several planar lasers of one robot: each scan is answered on its own laser's channels, all lasers show the
// same virtual world, and one's fault is its own.
#include "tests/server/tick/several_lasers.hpp"

#include <gmock/gmock.h>

#include "tests/server/tick/levels_fixture.hpp"
#include "tests/server/tick/walker.hpp"

namespace parhelion::tick {
namespace {

using namespace test;
using testing::HasSubstr;

const std::vector<AgentDefinition> kBarrels{agent("barrel_1", AgentKind::barrel, 0, 0),
                                            agent("barrel_2", AgentKind::barrel, 2.5, -1.5)};

class SeveralLasersTest : public LevelsTest {
 protected:
  void run_drive(const std::vector<Message>& log, const RobotDescription& robot = robot_with_two_lasers(),
                 const std::vector<AgentDefinition>& agents = kBarrels) {
    out_.clear();
    start(two_lasers_configuration(agents, robot));
    feed(log);
  }
  std::size_t live(const std::string& info_channel) {
    std::size_t count = 0;
    for (const ScanInfo& info : decoded<ScanInfo>(info_channel)) count += info.live;
    return count;
  }
};

std::size_t scans_of(const std::vector<Message>& log, const std::string& channel) {
  return static_cast<std::size_t>(
      std::count_if(log.begin(), log.end(), [&](const Message& each) { return each.channel == channel; }));
}

TEST_F(SeveralLasersTest, EachScanIsAnsweredOnceOnTheChannelsOfItsLaser) {
  const auto log = two_lasers_drive(3);
  run_drive(log);
  const std::size_t front = scans_of(log, channel::kScan), rear = scans_of(log, kRearScan);
  EXPECT_EQ(out_[channel::kMrScan].size(), front);
  EXPECT_EQ(out_[channel::kMrScanInfo].size(), front);
  EXPECT_EQ(out_[kMrRearScan].size(), rear);
  EXPECT_EQ(out_[kMrRearScanInfo].size(), rear);
  EXPECT_GT(live(channel::kMrScanInfo), front - 5);
  EXPECT_GT(live(kMrRearScanInfo), rear - 5);
  EXPECT_EQ(state_->tally.scans_in, front + rear);
  EXPECT_EQ(state_->tally.scans_out, front + rear);
}

TEST_F(SeveralLasersTest, AnAnswerHasTheStampAndTheBeamsOfItsScan) {
  const auto log = two_lasers_drive(2);
  run_drive(log);
  for (const auto& [in, out] : {std::pair(std::string(channel::kScan), std::string(channel::kMrScan)),
                                std::pair(kRearScan, kMrRearScan)}) {
    const auto answers = decoded<Scan>(out);
    std::size_t i = 0;
    for (const Message& each : log) {
      if (each.channel != in) continue;
      Scan scan;
      ASSERT_TRUE(decode(each.channel, each.payload, scan).ok());
      EXPECT_EQ(answers.at(i).stamp, scan.stamp);
      EXPECT_EQ(answers.at(i).ranges.size(), scan.ranges.size());
      EXPECT_EQ(answers.at(i++).angle_increment, scan.angle_increment);
    }
  }
}

/// A robot of the simple kind that goes to and fro in the middle of the circle.
AgentDefinition patrol() {
  AgentDefinition phantom = agent("phantom", AgentKind::robot, -0.4, 0, BehaviourKind::patrol);
  phantom.behaviour.waypoints = {{0.5, 0.2}, {-0.5, -0.2}};
  return phantom;
}

/// m from a point of the map to the upper part of such a robot, a box at the height of both lasers.
double off_upper_part(const WorldSnapshot& world, const Eigen::Vector3d& place) {
  double off = std::numeric_limits<double>::infinity();
  for_each_body(world, [&](const BodyDefinition& body, const BodyState& state) {
    if (body.entity != "phantom" || body.part != "chassis") return;
    const Shape& upper = body.shapes.at(3);
    const Eigen::Vector3d p = (state.T_map_body * upper.T_body_shape).inverse() * place;
    off = (p.cwiseAbs() - upper.size / 2).head<2>().maxCoeff();
  });
  return off;
}

/// The worst distance of a laser's returns from the phantom at the instant of each beam, and at the stamp.
struct Misplaced {
  std::size_t returns = 0;
  double at_beam = 0, at_stamp = 0;  // m
};

class OnePlaceTest : public SeveralLasersTest {
 protected:
  /// Of the newest answer on `mr_scan`.
  void add_newest(const LaserDescription& laser, const std::string& mr_scan, const std::string& mr_info,
                  Misplaced& misplaced) {
    Scan scan;
    ScanInfo info;
    ASSERT_TRUE(decode(mr_scan, out_[mr_scan].back(), scan).ok());
    ASSERT_TRUE(decode(mr_info, out_[mr_info].back(), info).ok());
    std::vector<float> time;
    const scan::Sweep sweep = scan::beam_times(laser, scan, time);
    const ClockOffset& clock = state_->robots.front().pose.clock;
    for (std::size_t i = 0; i < info.beam_agent.size(); ++i) {
      if (info.beam_agent[i] < 0) continue;
      const Duration into =
          sweep.start + seconds(static_cast<double>(time[i]) * (sweep.end - sweep.start).seconds());
      const double t = (scan.stamp - SensorTime::from_utime(kStartUs)).seconds() + into.seconds();
      const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
      const double range = scan.ranges[i];
      const Eigen::Vector3d place = pose_at(t) * laser.T_base_laser *
                                    Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0);
      ASSERT_TRUE(state_->simulation.at(clock.to_server(scan.stamp + into), world_));
      misplaced.at_beam = std::max(misplaced.at_beam, std::abs(off_upper_part(world_, place)));
      ASSERT_TRUE(state_->simulation.at(clock.to_server(scan.stamp), world_));
      misplaced.at_stamp = std::max(misplaced.at_stamp, std::abs(off_upper_part(world_, place)));
      ++misplaced.returns;
    }
  }

  WorldSnapshot world_;
};

TEST_F(OnePlaceTest, BothLasersShowAMovingPhantomWhereItIsAtTheInstantOfEachBeam) {
  const RobotDescription robot = robot_with_two_lasers(0);
  start(two_lasers_configuration({patrol()}, robot));
  Misplaced front, rear;
  int both = 0;
  std::size_t front_before = 0;
  for (const Message& each : two_lasers_drive(8, robot)) {
    feed(each);
    if (each.channel == channel::kScan) {
      front_before = front.returns;
      add_newest(robot.laser_at(0), channel::kMrScan, channel::kMrScanInfo, front);
    }
    if (each.channel == kRearScan) {
      const std::size_t before = rear.returns;
      add_newest(robot.laser_at(1), kMrRearScan, kMrRearScanInfo, rear);
      both += rear.returns > before && front.returns > front_before;
    }
  }
  EXPECT_GT(both, 40) << "neighbouring scans of both lasers show it";
  EXPECT_GT(front.returns, 500U);
  EXPECT_GT(rear.returns, 500U);
  RecordProperty("worst_mm", std::to_string(1e3 * std::max(front.at_beam, rear.at_beam)));
  EXPECT_LT(front.at_beam, 0.001);
  EXPECT_LT(rear.at_beam, 0.001);
  // A sweep of 50 ms at one instant would be seen.
  EXPECT_GT(front.at_stamp, 0.005);
  EXPECT_GT(rear.at_stamp, 0.003);
}

TEST_F(SeveralLasersTest, TheFirstLaserGetsTheSameBytesWithAndWithoutAnother) {
  RobotDescription one_laser = robot_with_two_lasers();
  one_laser.further_lasers.clear();
  run_drive(two_lasers_drive(4), one_laser);
  const auto alone = out_[channel::kMrScan], alone_info = out_[channel::kMrScanInfo];
  EXPECT_TRUE(out_[kMrRearScan].empty());
  run_drive(two_lasers_drive(4));
  EXPECT_EQ(out_[channel::kMrScan], alone);
  EXPECT_EQ(out_[channel::kMrScanInfo], alone_info);
}

TEST_F(SeveralLasersTest, EachLaserHasNoiseOfItsOwn) {
  RobotDescription alike = robot_with_two_lasers();
  alike.further_lasers.front().laser = *alike.laser;
  std::vector<Message> log = two_lasers_drive(2, alike);
  std::erase_if(log, [](const Message& each) { return each.channel == kRearScan; });
  std::vector<Message> both;
  for (const Message& each : log) {
    both.push_back(each);
    if (each.channel != channel::kScan) continue;
    both.push_back({kRearScan, each.arrival + microseconds(1), each.payload});
  }
  run_drive(both, alike);
  const auto one = decoded<Scan>(channel::kMrScan), other = decoded<Scan>(kMrRearScan);
  const auto info = decoded<ScanInfo>(channel::kMrScanInfo);
  ASSERT_EQ(one.size(), other.size());
  std::size_t replaced = 0, same = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    for (std::size_t beam = 0; beam < one[i].ranges.size(); ++beam) {
      if (info[i].beam_agent.at(beam) < 0) continue;
      ++replaced;
      same += one[i].ranges[beam] == other[i].ranges[beam];
    }
  }
  EXPECT_GT(replaced, 100U);
  // Of 5 mm noise in steps of 10 mm every second or third agrees by chance.
  EXPECT_LT(same, replaced * 7 / 10);
}

/// Walks to and fro beside the robot's circle, at up to 0.9 m/s.
Eigen::Vector2d walker_between(double t) { return {-1.5, 2.5 * std::sin(0.36 * t)}; }

/// The drive of both lasers, with a walker in the scans of the channels in `shown`.
std::vector<Message> drive_with_a_walker(const std::vector<std::string>& shown) {
  const RobotDescription robot = robot_with_two_lasers();
  std::vector<Message> log = two_lasers_drive(10);
  for (Message& each : log) {
    if (std::find(shown.begin(), shown.end(), each.channel) == shown.end()) continue;
    Scan scan;
    EXPECT_TRUE(decode(each.channel, each.payload, scan).ok());
    const double t = (scan.stamp - SensorTime::from_utime(kStartUs)).seconds();
    const LaserDescription& laser = robot.laser_at(each.channel == kRearScan ? 1 : 0);
    put_walker(walker_between(t), t, pose_at(t) * laser.T_base_laser, scan);
    each = message(each.channel, each.arrival.utime(), scan);
  }
  return log;
}

class PeopleOfBothLasersTest : public SeveralLasersTest {
 protected:
  /// Number of scans after which the walker was followed, and the most persons at once.
  std::pair<int, std::size_t> follow(const std::vector<Message>& log) {
    std::pair<int, std::size_t> seen{};
    start(two_lasers_configuration({}));
    for (const Message& each : log) {
      feed(each);
      if (each.channel != channel::kScan && each.channel != kRearScan) continue;
      const double t = static_cast<double>(each.arrival.utime() - kStartUs) * 1e-6;
      const auto& persons = state_->bystanders.persons;
      seen.second = std::max(seen.second, persons.size());
      seen.first += std::any_of(persons.begin(), persons.end(), [&](const simulation::RealPerson& person) {
        return (person.position - walker_between(t)).norm() < 0.5;
      });
    }
    return seen;
  }
};

TEST_F(PeopleOfBothLasersTest, AWalkerWhomOnlyTheRearLaserShowsIsFollowed) {
  EXPECT_EQ(follow(drive_with_a_walker({})).first, 0);
  EXPECT_GE(follow(drive_with_a_walker({kRearScan})).first, 40);
}

TEST_F(PeopleOfBothLasersTest, AWalkerWhomBothLasersShowIsOnePerson) {
  const auto [followed, max_persons] = follow(drive_with_a_walker({channel::kScan, kRearScan}));
  EXPECT_GE(followed, 60);
  EXPECT_EQ(max_persons, 1U);
}

TEST_F(SeveralLasersTest, WhatOnlyTheRearLaserSeesIsAnObstacleOfAgents) {
  std::vector<Message> log = two_lasers_drive(3);
  for (Message& each : log) {
    if (each.channel != kRearScan) continue;
    Scan scan;
    ASSERT_TRUE(decode(each.channel, each.payload, scan).ok());
    const std::size_t middle = scan.ranges.size() / 2;
    for (std::size_t i = middle - 4; i < middle + 4; ++i) scan.ranges[i] = 0.8F;
    each = message(kRearScan, each.arrival.utime(), scan);
  }
  run_drive(log);
  EXPECT_TRUE(state_->robots.front().scan.obstacles.empty());
  const auto& obstacles = state_->robots.front().further_lasers.front().scan.obstacles;
  ASSERT_EQ(obstacles.size(), 1U);
  const auto T_map_laser = pose_at(2.9) * robot_with_two_lasers().laser_at(1).T_base_laser;
  EXPECT_NEAR((obstacles.front().center - T_map_laser.translation().head<2>()).norm(), 0.8, 0.15);
}

class FaultOfOneLaserTest : public SeveralLasersTest {
 protected:
  static constexpr std::int64_t kFaultUs = kStartUs + 1'000'000;
  /// Runs the drive with the messages of `channel` changed after a second; `change` returns whether to keep
  /// one.
  template <class Change>
  void run_with_fault(const std::string& channel, Change change) {
    std::vector<Message> log = two_lasers_drive(4);
    std::erase_if(log, [&](Message& each) {
      return each.channel == channel && each.arrival > ArrivalTime::from_utime(kFaultUs) && !change(each);
    });
    run_drive(log);
  }
  std::vector<Event> suspended_after_fault() {
    auto all = events(EventKind::injection_suspended);
    std::erase_if(all, [](const Event& each) { return each.stamp.ns <= kFaultUs * 1000; });
    return all;
  }
  std::vector<std::vector<std::uint8_t>> healthy(const std::string& channel) {
    run_drive(two_lasers_drive(4));
    return out_[channel];
  }
};

TEST_F(FaultOfOneLaserTest, ASilentFurtherLaserIsReportedByNameAndHarmsNoOther) {
  const auto front = healthy(channel::kMrScan);
  run_with_fault(kRearScan, [](Message&) { return false; });
  EXPECT_EQ(out_[channel::kMrScan], front);
  const auto suspended = suspended_after_fault();
  ASSERT_EQ(suspended.size(), 1U);
  EXPECT_EQ(suspended[0].subject, "synthetic");
  EXPECT_EQ(suspended[0].object, kRear);
  EXPECT_EQ(suspended[0].text, "no scan for 0.5 s");
}

TEST_F(FaultOfOneLaserTest, ASilentFirstLaserLeavesTheOtherLive) {
  const std::size_t rear = healthy(kMrRearScan).size(), rear_live = live(kMrRearScanInfo);
  run_with_fault(channel::kScan, [](Message&) { return false; });
  EXPECT_EQ(out_[kMrRearScan].size(), rear);
  EXPECT_EQ(live(kMrRearScanInfo), rear_live);
  const auto suspended = suspended_after_fault();
  ASSERT_EQ(suspended.size(), 1U);
  EXPECT_EQ(suspended[0].object, "");
}

TEST_F(FaultOfOneLaserTest, ScansOfAnotherClockComeBackUnchangedWithTheReasonAndHarmNoOther) {
  const auto front = healthy(channel::kMrScan);
  std::vector<std::vector<std::uint8_t>> sent;
  run_with_fault(kRearScan, [&sent](Message& each) {
    Scan scan;
    EXPECT_TRUE(decode(each.channel, each.payload, scan).ok());
    scan.stamp = scan.stamp + seconds(10.0);
    encode(scan, each.payload);
    sent.push_back(each.payload);
    return true;
  });
  EXPECT_EQ(out_[channel::kMrScan], front);
  const auto& answers = out_[kMrRearScan];
  const auto info = decoded<ScanInfo>(kMrRearScanInfo);
  ASSERT_GT(sent.size(), 30U);
  ASSERT_GT(answers.size(), sent.size());
  ASSERT_EQ(answers.size(), info.size());
  const std::size_t before = answers.size() - sent.size();
  EXPECT_TRUE(std::equal(sent.begin(), sent.end(), answers.begin() + static_cast<std::ptrdiff_t>(before)));
  for (std::size_t i = before; i < info.size(); ++i) {
    EXPECT_FALSE(info[i].live);
    EXPECT_THAT(info[i].reason, HasSubstr("off the robot's clock"));
  }
  EXPECT_GE(state_->robots.front().further_lasers.front().scan.degraded, sent.size());
  EXPECT_EQ(state_->robots.front().scan.degraded, out_[channel::kMrScan].size() - live(channel::kMrScanInfo));
}

TEST_F(FaultOfOneLaserTest, AMessageOfAnotherTypeIsReportedOnThatLasersChannel) {
  const auto front = healthy(channel::kMrScan);
  run_with_fault(kRearScan, [](Message& each) {
    encode(Odometry{}, each.payload);
    return true;
  });
  EXPECT_EQ(out_[channel::kMrScan], front);
  EXPECT_THAT(decoded<ScanInfo>(kMrRearScanInfo).back().reason, HasSubstr("pose2D_t"));
  EXPECT_THAT(decoded<ScanInfo>(channel::kMrScanInfo).back().reason, testing::IsEmpty());
}

TEST_F(SeveralLasersTest, ASimulatedRobotHasAllOfItsLasers) {
  Configuration configuration = level_1({agent("barrel_1", AgentKind::barrel, -3.2, 0)});
  RobotModels models = configuration.robot_models;
  simulation::RobotModel model = *models.front();
  LaserDescription rear = *model.description.laser;
  rear.T_base_laser = Transform<Base, Laser>::planar(-0.2, 0, std::numbers::pi, 0.3);
  rear.scan_period = 0.1;
  model.description.further_lasers = {{kRear, rear}};
  const auto made =
      configure(configuration.scenario, {}, room(), {std::make_shared<const simulation::RobotModel>(model)});
  ASSERT_TRUE(made.ok()) << made.error().message;
  start(*made);
  run(2);
  EXPECT_NEAR(static_cast<double>(out_[kRearScan].size()), 20, 1);
  EXPECT_EQ(out_[kMrRearScan], out_[kRearScan]);
  const auto info = decoded<ScanInfo>(kMrRearScanInfo);
  ASSERT_EQ(info.size(), out_[kRearScan].size());
  EXPECT_THAT(info.back().agents, testing::ElementsAre("barrel_1")) << "behind the robot";
  EXPECT_NEAR(static_cast<double>(out_[channel::kScan].size()), 2 * 40, 2);
}

TEST(SeveralLasersConfiguration, TheSessionHeaderKeepsAllLasersAndTheirChannels) {
  Scenario scenario;
  scenario.channels = {{kRearScan, "BACK"}};
  const auto made = configure(scenario, robot_with_two_lasers(), room());
  ASSERT_TRUE(made.ok()) << made.error().message;
  const auto back = configuration_from(session_header(*made, {}), "log");
  ASSERT_TRUE(back.ok()) << back.error().message;
  ASSERT_EQ(back->robot.further_lasers.size(), 1U);
  EXPECT_EQ(back->robot.further_lasers.front().name, kRear);
  std::size_t laser = 0;
  EXPECT_EQ(back->channels.kind("BACK", nullptr, nullptr, &laser), InputKind::scan);
  EXPECT_EQ(laser, 1U);
  EXPECT_EQ(back->channels.robots_bus(channel::kMrScan, 0, 1), kMrRearScan);
}

TEST(SeveralLasersConfiguration, OfSeveralRobotsEachLasersChannelsCarryTheRobotsName) {
  Scenario scenario;
  scenario.robots = {{"rover_1", ""}, {"rover_2", ""}};
  const auto made = configure_robots(scenario, {robot(), robot_with_two_lasers()}, room());
  ASSERT_TRUE(made.ok()) << made.error().message;
  std::size_t robot = 0, laser = 0;
  EXPECT_EQ(made->channels.kind("SCAN_rear.rover_2", nullptr, &robot, &laser), InputKind::scan);
  EXPECT_EQ(robot, 1U);
  EXPECT_EQ(laser, 1U);
  EXPECT_EQ(made->channels.kind("SCAN_rear.rover_1"), InputKind::none);
  EXPECT_EQ(made->channels.robots_bus(channel::kMrScanInfo, 1, 1), "MR_SCAN_INFO_rear.rover_2");
}

std::string refusal(const std::map<std::string, std::string>& channels) {
  Scenario scenario;
  scenario.name = "yard";
  scenario.channels = channels;
  const auto made = configure(scenario, robot_with_two_lasers(), room());
  return made.ok() ? "" : made.error().message;
}

TEST(SeveralLasersConfiguration, TwoChannelsOfOneNameAreRefused) {
  EXPECT_EQ(refusal({{"SCAN", "LIDAR"}, {"MR_SCAN_rear", "BACK"}}), "");
  EXPECT_EQ(refusal({{"ODOMETRY", "SCAN_rear"}}),
            "scenario 'yard': 'channels': SCAN_rear and ODOMETRY would both be named 'SCAN_rear' on the bus: "
            "give one of them another name");
  EXPECT_THAT(refusal({{"MR_SCAN_rear", "SCAN"}}), HasSubstr("the output MR_SCAN_rear and the input SCAN"));
}

TEST(SeveralLasersConfiguration, AChannelOfALaserThatIsNotThereIsRefused) {
  EXPECT_EQ(
      refusal({{"SCAN_raer", "BACK"}}),
      "scenario 'yard': 'channels' renames SCAN_raer, but no robot's 'lasers' or 'cameras' has that name, "
      "did you mean 'SCAN_rear'?");
}

}  // namespace
}  // namespace parhelion::tick
