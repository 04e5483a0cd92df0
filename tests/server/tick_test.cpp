// The tick on its own: promises 1, 2 and 3 at the level of messages.
#include "server/tick.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "protocols/sha256.hpp"
#include "tests/server/tick_fixture.hpp"

namespace parhelion {
namespace {

using test::agent;
using test::TickTest;

TEST_F(TickTest, TickPutsAVirtualBarrelIntoTheScanAndLeavesTheOtherBeams) {
  start(test::configuration({agent("barrel_1", AgentKind::barrel, 3.0, 2.0)}));
  const auto log = test::drive(3);
  feed(log);
  std::vector<Scan> real;
  for (const Message& each : log) {
    if (each.channel != channel::scan) continue;
    ASSERT_TRUE(decode(each.channel, each.payload, real.emplace_back()).ok());
  }
  const auto out = decoded<Scan>(channel::mr_scan);
  const auto info = decoded<ScanInfo>(channel::mr_scan_info);
  ASSERT_EQ(out.size(), real.size());
  ASSERT_EQ(info.size(), real.size());
  std::size_t replaced = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    ASSERT_EQ(out[i].stamp, real[i].stamp);
    ASSERT_EQ(out[i].ranges.size(), real[i].ranges.size());
    for (std::size_t beam = 0; beam < out[i].ranges.size(); ++beam) {
      if (info[i].beam_agent[beam] < 0) {
        ASSERT_EQ(std::memcmp(&out[i].ranges[beam], &real[i].ranges[beam], 4), 0);
        continue;
      }
      ++replaced;
      ASSERT_LT(out[i].ranges[beam], real[i].ranges[beam]);
      // The return lies on the barrel, which stands at (3, 2) and is 0.4 m wide.
      const double t = static_cast<double>(real[i].stamp.utime() - test::start_us) * 1e-6;
      const double angle = real[i].angle_first + static_cast<double>(beam) * real[i].angle_step;
      const Eigen::Vector3d p_laser(out[i].ranges[beam] * std::cos(angle),
                                    out[i].ranges[beam] * std::sin(angle), 0);
      const Eigen::Vector3d p_map = test::pose_at(t) * (test::robot().laser->T_base_laser * p_laser);
      ASSERT_NEAR((p_map.head<2>() - Eigen::Vector2d(3, 2)).norm(), 0.2, 0.05)
          << "scan " << i << " beam " << beam;
    }
  }
  EXPECT_GT(replaced, 50U);
}

TEST_F(TickTest, TickAnswersTheFirstScansWithThemselvesUntilThereIsAPose) {
  start(test::configuration({agent("box_1", AgentKind::box, 3, 0)}));
  const Message first = test::message(channel::scan, test::start_us + 100, test::scan_at(0));
  feed(first);
  ASSERT_EQ(out_[channel::mr_scan].size(), 1U);
  EXPECT_EQ(out_[channel::mr_scan][0], first.payload);
  const auto info = decoded<ScanInfo>(channel::mr_scan_info);
  EXPECT_FALSE(info[0].live);
  EXPECT_FALSE(info[0].reason.empty());
}

TEST_F(TickTest, TickGivesOneScanForEachScanWhateverElseComesIn) {
  start(test::configuration({agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander),
                             agent("person_1", AgentKind::person, -3, 0, BehaviourKind::wander)}));
  std::mt19937 random(7);
  auto log = test::drive(6);
  std::size_t scans = 0;
  for (std::size_t i = 0; i < log.size(); ++i) {
    Message each = log[i];
    const bool is_scan = each.channel == channel::scan;
    scans += is_scan ? 1 : 0;
    // Everything but the scans is damaged at random: bits, length, stamps.
    if (!is_scan && random() % 2 == 0 && !each.payload.empty()) {
      each.payload[random() % each.payload.size()] ^= static_cast<std::uint8_t>(1U << (random() % 8));
      if (random() % 4 == 0) each.payload.resize(random() % each.payload.size());
    }
    feed(each);
    ASSERT_EQ(out_[channel::mr_scan].size(), scans);
    ASSERT_EQ(out_[channel::mr_scan_info].size(), scans);
  }
  EXPECT_GT(state_->tally.refused_inputs, 0U);
}

TEST_F(TickTest, TickPassesOnAScanThatCannotBeReadWithTheReason) {
  start(test::configuration({agent("box_1", AgentKind::box, 3, 2)}));
  feed(test::drive(2));
  const Message whole = test::message(channel::scan, test::start_us + 2'006'000, test::scan_at(2.0));
  const auto floats = [](Message scan, std::size_t from_end, float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, 4);
    for (std::size_t i = 0; i < 4; ++i)
      scan.payload[scan.payload.size() - from_end + i] = static_cast<std::uint8_t>(bits >> (24 - 8 * i));
    return scan;
  };
  const auto with = [&](std::size_t at, std::initializer_list<std::uint8_t> bytes) {
    Message scan = whole;
    std::copy(bytes.begin(), bytes.end(), scan.payload.begin() + static_cast<std::ptrdiff_t>(at));
    return scan;
  };
  std::vector<std::pair<Message, std::string>> bad{
      {floats(whole, 8, std::numeric_limits<float>::quiet_NaN()), "rad0"},
      {floats(whole, 4, std::numeric_limits<float>::infinity()), "radstep"},
      {floats(whole, 4, 0), "radstep"},
      {with(8, {0x80, 0, 0, 0, 0, 0, 0, 0}), "utime"},
      {with(8, {0x7F, 0xF8, 0, 0, 0, 0, 0, 0}), "utime"},  // NaN, for a sender that writes doubles
      {with(16, {0x7F, 0xFF, 0xFF, 0xFF}), "nranges"},
      {with(16, {0xFF, 0xFF, 0xFF, 0xFF}), "nranges"},
      {with(16, {0, 0, 0, 0}), "nranges"}};
  for (std::size_t size = 8; size < whole.payload.size(); ++size) {
    Message cut = whole;
    cut.payload.resize(size);
    bad.emplace_back(std::move(cut), "");
  }
  const std::uint64_t before = state_->tally.scans_in;
  std::uint64_t count = 0;
  for (auto& [scan, reason] : bad) {
    scan.arrival = scan.arrival + microseconds(static_cast<std::int64_t>(++count));
    feed(scan);
    ASSERT_EQ(out_[channel::mr_scan].back(), scan.payload) << "unchanged, after " << count;
    const ScanInfo info = decoded<ScanInfo>(channel::mr_scan_info).back();
    EXPECT_FALSE(info.live);
    EXPECT_TRUE(info.beam_agent.empty());
    EXPECT_NE(info.reason.find("SCAN"), std::string::npos) << info.reason;
    EXPECT_NE(info.reason.find(reason), std::string::npos) << info.reason;
    const bool has_stamp = scan.payload.size() >= 16 && reason != "utime";
    EXPECT_EQ(info.stamp.utime(), has_stamp ? test::start_us + 2'000'000 : scan.arrival.utime());
  }
  EXPECT_EQ(state_->tally.scans_in - before, count);
  EXPECT_EQ(state_->tally.scans_out, state_->tally.scans_in);
  EXPECT_EQ(out_[channel::mr_scan].size(), state_->tally.scans_in);
  EXPECT_EQ(state_->tally.scans_degraded[static_cast<std::size_t>(Degraded::unreadable)], count);
  // What follows is answered as ever.
  Message next = test::message(channel::scan, test::start_us + 2'106'000, test::scan_at(2.1));
  feed(test::message(channel::odometry, test::start_us + 2'102'000,
                     Odometry{SensorTime::from_utime(test::start_us + 2'100'000),
                              Transform<Odom, Base>(test::pose_at(2.1).isometry())}));
  feed(next);
  EXPECT_TRUE(decoded<ScanInfo>(channel::mr_scan_info).back().live);
}

TEST_F(TickTest, TickAnswersFlippedScansOneForOneAndNeverSendsOnWhatIsNoScan) {
  start(test::configuration({agent("box_1", AgentKind::box, 3, 2)}));
  feed(test::drive(2));
  std::mt19937 random(5);
  std::int64_t arrival = test::start_us + 2'006'000;
  for (int round = 0; round < 3000; ++round) {
    Message scan = test::message(channel::scan, ++arrival, test::scan_at(2.0));
    for (unsigned flips = 1 + random() % 4; flips > 0; --flips) {
      // A third of the flips hit the fields before the ranges.
      const std::size_t at = random() % (random() % 3 == 0 ? 20 : scan.payload.size());
      scan.payload[at] ^= static_cast<std::uint8_t>(1U << (random() % 8));
    }
    const std::size_t scans = out_[channel::mr_scan].size(), infos = out_[channel::mr_scan_info].size();
    const std::uint64_t foreign = state_->tally.foreign_scans;
    feed(scan);
    ASSERT_EQ(out_[channel::mr_scan_info].size(), infos + 1);
    const ScanInfo info = decoded<ScanInfo>(channel::mr_scan_info).back();
    if (!claims_to_be_scan(scan.payload)) {
      ASSERT_EQ(out_[channel::mr_scan].size(), scans) << "of another type";
      ASSERT_EQ(state_->tally.foreign_scans, foreign + 1);
      ASSERT_NE(info.reason.find("planar_lidar_t"), std::string::npos) << info.reason;
      ASSERT_EQ(info.stamp.utime(), scan.arrival.utime());
      continue;
    }
    ASSERT_EQ(out_[channel::mr_scan].size(), scans + 1);
    const auto& answer = out_[channel::mr_scan].back();
    ASSERT_EQ(answer.size(), scan.payload.size());
    if (!info.live) {
      ASSERT_EQ(answer, scan.payload);
    }
    out_.clear();
  }
  EXPECT_GT(state_->tally.foreign_scans, 0U);
  EXPECT_EQ(state_->tally.scans_out, state_->tally.scans_in);
}

TEST_F(TickTest, TickPassesScansThroughWhileSlamIsLost) {
  start(test::configuration({agent("box_1", AgentKind::box, 3, 2)}));
  feed(test::drive(2));
  PoseEstimate lost;
  lost.stamp = SensorTime::from_utime(test::start_us + 1'990'000);
  lost.state = SlamState::lost;
  lost.map_id = "synthetic";
  lost.covariance = PoseCovariance::Identity();
  feed(test::message(channel::pose_cov, test::start_us + 2'000'000, lost));
  const Message scan = test::message(channel::scan, test::start_us + 2'006'000, test::scan_at(2.0));
  feed(scan);
  EXPECT_EQ(out_[channel::mr_scan].back(), scan.payload);
  EXPECT_FALSE(decoded<ScanInfo>(channel::mr_scan_info).back().live);
}

TEST_F(TickTest, TickPassesScansThroughWhereTheMapIsAnother) {
  Configuration other = test::configuration({agent("box_1", AgentKind::box, 3, 2)});
  other.model.map_id = "another map";
  start(std::move(other));
  feed(test::drive(2));
  for (const ScanInfo& info : decoded<ScanInfo>(channel::mr_scan_info)) EXPECT_FALSE(info.live);
}

TEST_F(TickTest, TickAnswersAScanWhoseStampIsAnHourOffWithItself) {
  start(test::configuration({agent("box_1", AgentKind::box, 3, 2)}));
  feed(test::drive(2));
  Scan late = test::scan_at(2.0);
  late.stamp = late.stamp - seconds(3600);
  const Message scan = test::message(channel::scan, test::start_us + 2'006'000, late);
  feed(scan);
  EXPECT_EQ(out_[channel::mr_scan].back(), scan.payload);
  Scan next = test::scan_at(2.1);
  feed(test::message(channel::odometry, test::start_us + 2'101'000,
                     Odometry{next.stamp, Transform<Odom, Base>(test::pose_at(2.1).isometry())}));
  feed(test::message(channel::scan, test::start_us + 2'106'000, next));
  EXPECT_TRUE(decoded<ScanInfo>(channel::mr_scan_info).back().live)
      << "one bad stamp must not blind what follows";
}

TEST_F(TickTest, TickAnswersEachAgentCommandWithAnEvent) {
  start(test::configuration({}));
  feed(test::drive(2));
  AgentCommand command;
  command.request = 42;
  command.agent = agent("box_1", AgentKind::box, 3, 2);
  feed(test::message(channel::mr_agent_cmd, test::start_us + 2'000'000, command));
  command.request = 43;  // the same name again
  feed(test::message(channel::mr_agent_cmd, test::start_us + 2'000'100, command));
  command.request = 44;  // cannot be read
  command.agent.name = "box/2";
  feed(test::message(channel::mr_agent_cmd, test::start_us + 2'000'200, command));
  std::map<std::uint64_t, EventKind> answers;
  std::map<std::uint64_t, std::string> reasons;
  for (const Event& event : decoded<Event>(channel::mr_events)) {
    if (event.request == 0) continue;
    answers[event.request] = event.kind;
    reasons[event.request] = event.text;
  }
  EXPECT_EQ(answers[42], EventKind::command_accepted);
  EXPECT_EQ(answers[43], EventKind::command_refused);
  EXPECT_EQ(answers[44], EventKind::command_refused);
  EXPECT_NE(reasons[44].find("name"), std::string::npos) << reasons[44];
}

TEST_F(TickTest, TickRefusesAnAgentOnTheRealRobotAndSaysWhereThereIsRoom) {
  start(test::configuration({}));
  feed(test::drive(2));
  AgentCommand command;
  command.request = 1;
  const auto here = test::pose_at(2).translation();
  command.agent = agent("box_1", AgentKind::box, here.x(), here.y());
  feed(test::message(channel::mr_agent_cmd, test::start_us + 2'000'000, command));
  const auto events = decoded<Event>(channel::mr_events);
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
    const std::int64_t utime = test::start_us + 50'000 * i + 11'000;
    command.stamp = SensorTime::from_utime(utime);
    command.twist = {component(random), 0, component(random)};
    log.push_back(test::message(channel::teleop, utime, command));
  }
  std::stable_sort(log.begin(), log.end(),
                   [](const auto& a, const auto& b) { return a.arrival < b.arrival; });
  int reduced = 0;
  for (const Message& each : log) {
    out_.clear();
    feed(each);
    if (each.channel != channel::teleop) continue;
    TwistCommand command;
    ASSERT_TRUE(decode(each.channel, each.payload, command).ok());
    const auto given = decoded<TwistCommand>(channel::mr_cmd);
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

TEST_F(TickTest, TickStopsTheRobotWhenTeleopFallsSilent) {
  start(test::configuration({}));
  auto log = test::drive(4);
  TwistCommand command;
  command.stamp = SensorTime::from_utime(test::start_us + 1'000'000);
  command.twist = {0.5, 0, 0};
  log.push_back(test::message(channel::teleop, test::start_us + 1'000'000, command));
  std::stable_sort(log.begin(), log.end(),
                   [](const auto& a, const auto& b) { return a.arrival < b.arrival; });
  feed(log);
  const auto given = decoded<TwistCommand>(channel::mr_cmd);
  ASSERT_GE(given.size(), 2U);
  EXPECT_EQ(given.back().twist.vx, 0);
  EXPECT_EQ(given.back().twist.wz, 0);
}

/// Whoever goes on driving: a frozen robot stands until it is let go and the dead-man was released.
TEST_F(TickTest, TickHoldsAnEmergencyStopAgainstWhoeverDrives) {
  start(test::configuration({}));
  auto log = test::drive(8);
  const auto add = [&](double s, double vx) {
    const std::int64_t utime = test::start_us + static_cast<std::int64_t>(s * 1e6) + 7;
    log.push_back(
        test::message(channel::teleop, utime, TwistCommand{SensorTime::from_utime(utime), {vx, 0, 0}}));
  };
  const auto order = [&](double s, AgentCommand::Action action, std::uint64_t request) {
    const std::int64_t utime = test::start_us + static_cast<std::int64_t>(s * 1e6);
    AgentCommand command;
    command.stamp = SensorTime::from_utime(utime);
    command.request = request;
    command.action = action;
    command.agent.name = configuration_.robot.name;
    log.push_back(test::message(channel::mr_agent_cmd, utime, command));
  };
  for (int i = 20; i < 60; ++i) add(0.1 * i, 0.3);  // a stick that is held all the time
  add(6.0, 0);
  for (int i = 61; i < 70; ++i) add(0.1 * i, 0.3);
  order(3, AgentCommand::Action::freeze, 7);
  order(5, AgentCommand::Action::unfreeze, 8);
  std::stable_sort(log.begin(), log.end(),
                   [](const auto& a, const auto& b) { return a.arrival < b.arrival; });
  double moved[4] = {};  // before, while it holds, until the stick is let go, afterwards
  for (const Message& each : log) {
    out_.clear();
    feed(each);
    const double s = (each.arrival.utime() - test::start_us) * 1e-6;
    const int part = s < 3 ? 0 : s < 5 ? 1 : s < 6 ? 2 : 3;
    for (const TwistCommand& command : decoded<TwistCommand>(channel::mr_cmd))
      moved[part] = std::max(moved[part], std::abs(command.twist.vx));
    for (const Event& event : decoded<Event>(channel::mr_events)) {
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

TEST_F(TickTest, TickWaitsForTheDepthImageOfTheSameMoment) {
  Configuration configuration = test::configuration({agent("box_1", AgentKind::box, 3, 2)});
  CameraIntrinsics lens;
  lens.width = 4;
  lens.height = 2;
  lens.fx = lens.fy = 4;
  configuration.robot.camera = CameraDescription{lens, {}, {}, 0, 0, 0, ""};
  configuration.robot.depth = DepthCameraDescription{lens, {}, {}, 0.1, 8, ""};
  start(std::move(configuration));
  feed(test::drive(2));
  const auto image = [](PixelFormat format, std::int64_t utime, int bytes_per_pixel) {
    Image made;
    made.stamp = SensorTime::from_utime(utime);
    made.width = 4;
    made.height = 2;
    made.row_stride = 4 * bytes_per_pixel;
    made.format = format;
    made.bytes.assign(static_cast<std::size_t>(8 * bytes_per_pixel), 7);
    if (format == PixelFormat::depth_mm) made.metadata.push_back({"encoding", {'r', 'a', 'w'}});
    return made;
  };
  const std::int64_t t = test::start_us + 1'990'000;
  feed(test::message(channel::depth, t - 30'000, image(PixelFormat::depth_mm, t - 33'000, 2)));
  feed(test::message(channel::camera, t + 2000, image(PixelFormat::bgr, t, 3)));
  EXPECT_TRUE(outputs_.frames().empty()) << "the depth image at hand shows an earlier moment";
  feed(test::message(channel::depth, t + 3000, image(PixelFormat::depth_mm, t, 2)));
  ASSERT_EQ(outputs_.frames().size(), 1U);
  ASSERT_TRUE(outputs_.frames()[0].job.depth.has_value());
  EXPECT_EQ(outputs_.frames()[0].job.depth->stamp, outputs_.frames()[0].job.image.stamp);

  feed(test::message(channel::camera, t + 35'000, image(PixelFormat::bgr, t + 33'000, 3)));
  EXPECT_TRUE(outputs_.frames().empty());
  outputs_.clear();
  advance(configuration_, ArrivalTime::from_utime(t + 95'000), *state_, outputs_, observer_);
  EXPECT_EQ(outputs_.frames().size(), 1U) << "no depth image came: not for long";
}

TEST_F(TickTest, TickGivesTheSameBytesHoweverOftenTheTimerTicks) {
  const auto run = [](bool with_timer) {
    const Configuration configuration =
        test::configuration({agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander)});
    auto state = *make_state(configuration, ArrivalTime::from_utime(test::start_us - 2000));
    Outputs outputs;
    StageObserver observer;
    std::map<std::string, Sha256> hashes;
    const auto keep = [&] {
      for (const Outputs::Entry& entry : outputs.entries()) hashes[entry.channel].add(entry.payload);
    };
    ArrivalTime last = ArrivalTime::from_utime(test::start_us - 2000);
    for (const Message& each : test::drive(3)) {
      for (; with_timer && last < each.arrival; last = last + microseconds(777)) {
        outputs.clear();
        advance(configuration, last, *state, outputs, observer);
        keep();
      }
      last = each.arrival;
      outputs.clear();
      tick(configuration, each, *state, outputs, observer);
      keep();
    }
    std::map<std::string, std::string> hex;
    for (auto& [channel, hash] : hashes) hex[channel] = hash.hex();
    return hex;
  };
  EXPECT_EQ(run(false), run(true));
}

/// A drive whose loop falls 0.6 s behind after 1 s; gives the hashes of what goes out on each channel.
/// `live`: the timer had done all steps until then, and how a scan was answered is noted when the disk lets
/// it. Otherwise from the log alone.
std::map<std::string, std::string> outputs_of_a_late_loop(bool live) {
  const Configuration configuration =
      test::configuration({agent("robot_1", AgentKind::robot, 0, 3, BehaviourKind::wander)});
  auto state = *make_state(configuration, ArrivalTime::from_utime(test::start_us - 2000));
  Outputs outputs;
  StageObserver observer;
  std::map<std::string, Sha256> hashes;
  const auto keep = [&] {
    for (const Outputs::Entry& entry : outputs.entries()) hashes[entry.channel].add(entry.payload);
    outputs.clear();
  };
  const auto take = [&](const Message& input) {
    tick(configuration, input, *state, outputs, observer);
    keep();
  };
  const auto decision = [](std::int64_t us, LoopDecision::Kind kind, std::int64_t count) {
    return test::message(channel::loop, us, LoopDecision{SensorTime::from_utime(us), kind, count});
  };
  for (const Message& each : test::drive(2)) {
    const std::int64_t us = each.arrival.utime() - test::start_us;
    if (us >= 900'000 && us < 1'600'000) continue;
    if (us >= 1'600'000 && us < 1'610'000) {
      if (live) {
        advance(configuration, ArrivalTime::from_utime(test::start_us + 1'000'000), *state, outputs,
                observer);
        keep();
      } else {
        take(decision(test::start_us + 1'590'000, LoopDecision::Kind::guard_fired, 9));
      }
      // At 240 Hz 143 steps are due since 1.0 s; the newest is done.
      take(decision(test::start_us + 1'595'000, LoopDecision::Kind::steps_skipped, 142));
    }
    take(each);
  }
  std::map<std::string, std::string> hex;
  for (auto& [channel, hash] : hashes) hex[channel] = hash.hex();
  return hex;
}

TEST_F(TickTest, TickSkipsTheStepsThatALateLoopSkippedAndDoesThoseThatItsTimerDid) {
  const auto live = outputs_of_a_late_loop(true);
  EXPECT_EQ(outputs_of_a_late_loop(false), live);
  EXPECT_TRUE(live.contains(channel::mr_world));
}

/// Fails in each seventh physics step.
class FaultyPhysics : public StageObserver {
 public:
  void ended(Stage stage) override {
    if (stage == Stage::physics_step && ++steps_ % 7 == 0) throw std::runtime_error("broken");
  }

 private:
  int steps_ = 0;
};

TEST_F(TickTest, TickGivesTheSameBytesHoweverOftenTheTimerTicksWherePhysicsIsFaulty) {
  const auto run = [](bool with_timer) {
    const Configuration configuration =
        test::configuration({agent("robot_1", AgentKind::robot, 0, 3, BehaviourKind::wander)});
    auto state = *make_state(configuration, ArrivalTime::from_utime(test::start_us - 2000));
    Outputs outputs;
    FaultyPhysics observer;
    std::map<std::string, std::vector<std::vector<std::uint8_t>>> all;
    ArrivalTime last = ArrivalTime::from_utime(test::start_us - 2000);
    for (const Message& each : test::drive(1)) {
      outputs.clear();
      for (; with_timer && last < each.arrival; last = last + microseconds(777))
        advance(configuration, last, *state, outputs, observer);
      last = each.arrival;
      tick(configuration, each, *state, outputs, observer);
      for (const Outputs::Entry& entry : outputs.entries()) all[entry.channel].push_back(entry.payload);
    }
    EXPECT_GT(state->tally.refused_inputs, 30U);
    EXPECT_LT(state->simulation.next_step().ns - last.ns, 5'000'000) << "it keeps up";
    return all;
  };
  EXPECT_EQ(run(false), run(true));
}

TEST_F(TickTest, TickNeverSkipsBeyondTheDecision) {
  start(test::configuration({}));
  const std::int64_t us = test::start_us + 1'000'000;
  feed(test::message(channel::loop, us,
                     LoopDecision{SensorTime::from_utime(us), LoopDecision::Kind::steps_skipped, 1'000'000}));
  EXPECT_LE(state_->simulation.now().ns, us * 1000);
  EXPECT_GT(state_->simulation.next_step().ns, us * 1000);
}

}  // namespace
}  // namespace parhelion
