// The tick on its own: promises 1 and 2 at the level of messages.
#include "server/tick/tick.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <numeric>
#include <random>

#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using test::agent;
using test::TickTest;

TEST_F(TickTest, TickInjectsABarrelAndKeepsTheOtherBeams) {
  start(test::configuration({agent("barrel_1", AgentKind::barrel, 3.0, 2.0)}));
  const auto log = test::drive(3);
  feed(log);
  const std::vector<Scan> real = scans_in(log);
  const auto out = decoded<Scan>(channel::kMrScan);
  const auto info = decoded<ScanInfo>(channel::kMrScanInfo);
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
      const double t = static_cast<double>(real[i].stamp.utime() - test::kStartUs) * 1e-6;
      const double angle = real[i].angle_min + static_cast<double>(beam) * real[i].angle_increment;
      const Eigen::Vector3d p_laser(out[i].ranges[beam] * std::cos(angle),
                                    out[i].ranges[beam] * std::sin(angle), 0);
      const Eigen::Vector3d p_map = test::pose_at(t) * (test::robot().laser->T_base_laser * p_laser);
      ASSERT_NEAR((p_map.head<2>() - Eigen::Vector2d(3, 2)).norm(), 0.2, 0.05)
          << "scan " << i << " beam " << beam;
    }
  }
  EXPECT_GT(replaced, 50U);
}

/// Keeps each MR_SCAN, and the server's state at that time.
class KeptScans : public ScanSink {
 public:
  explicit KeptScans(const std::unique_ptr<State>& state) : state_(state) {}
  Receipt publish(std::uint64_t sequence, std::span<const std::uint8_t> scan) override {
    EXPECT_EQ(sequence, scans.size() + 1);
    scans.emplace_back(scan.begin(), scan.end());
    learnt =
        learnt || state_->robots.front().scan.obstacles_seen == state_->robots.front().injection.last_scan;
    return {.sent = true, .raw = false};
  }
  std::vector<std::vector<std::uint8_t>> scans;
  bool learnt = false;  ///< something from the scan before its publication

 private:
  const std::unique_ptr<State>& state_;
};

TEST_F(TickTest, TickPublishesEachScanBeforeProcessingItFurther) {
  start(test::configuration({agent("barrel_1", AgentKind::barrel, 3.0, 2.0)}));
  KeptScans sink(state_);
  std::vector<std::vector<std::uint8_t>> sent;
  for (const Message& each : test::drive(3)) {
    outputs_.clear();
    tick(configuration_, each, *state_, outputs_, observer_, sink);
    for (const Outputs::Entry& entry : outputs_.entries()) {
      EXPECT_EQ(entry.sent, entry.channel == channel::kMrScan);
      if (entry.sent) sent.push_back(entry.payload);
    }
    ASSERT_EQ(sink.scans.size(), sent.size());
  }
  EXPECT_GT(sent.size(), 20U);
  EXPECT_TRUE(sink.scans == sent) << "what was published is not what is logged";
  EXPECT_FALSE(sink.learnt);
  EXPECT_EQ(state_->robots.front().scan.obstacles_seen, state_->robots.front().injection.last_scan)
      << "nothing was learnt at all";
}

/// The guard always fires first.
class LateSink : public ScanSink {
 public:
  Receipt publish(std::uint64_t, std::span<const std::uint8_t>) override {
    return {.sent = true, .raw = true};
  }
};

TEST_F(TickTest, TickLogsRawScansOfTheGuardWithTheReason) {
  start(test::configuration({agent("barrel_1", AgentKind::barrel, 3.0, 2.0)}));
  LateSink guard;
  const auto log = test::drive(3);
  std::size_t scans = 0;
  for (const Message& each : log) {
    outputs_.clear();
    tick(configuration_, each, *state_, outputs_, observer_, guard);
    for (const Outputs::Entry& entry : outputs_.entries()) {
      if (entry.channel == channel::kMrScan) {
        EXPECT_EQ(entry.payload, each.payload);
      }
      if (entry.channel != channel::kMrScanInfo) continue;
      ScanInfo info;
      ASSERT_TRUE(decode(entry.channel, entry.payload, info));
      EXPECT_FALSE(info.live);
      EXPECT_EQ(info.reason, "guard: no answer in time");
      EXPECT_TRUE(info.agents.empty());
      EXPECT_EQ(info.beam_agent, std::vector<std::int16_t>(181, -1));
      ++scans;
    }
  }
  EXPECT_EQ(scans, 30U);
  const auto& degraded = state_->tally.scans_degraded;
  EXPECT_GT(degraded[static_cast<std::size_t>(Degraded::guard)], 20U);
  EXPECT_EQ(std::accumulate(degraded.begin(), degraded.end(), std::uint64_t{0}), scans)
      << "a scan that was degraded anyway counts once";
}

TEST_F(TickTest, TickPassesScansThroughUntilThereIsAPose) {
  start(test::configuration({agent("box_1", AgentKind::box, 3, 0)}));
  const Message first = test::message(channel::kScan, test::kStartUs + 100, test::scan_at(0));
  feed(first);
  ASSERT_EQ(out_[channel::kMrScan].size(), 1U);
  EXPECT_EQ(out_[channel::kMrScan][0], first.payload);
  const auto info = decoded<ScanInfo>(channel::kMrScanInfo);
  EXPECT_FALSE(info[0].live);
  EXPECT_FALSE(info[0].reason.empty());
}

// Consoles drive what MR_WORLD names: a robot may have to move before it can be localized.
TEST_F(TickTest, TheWorldNamesARobotWithoutAPose) {
  start(test::configuration({agent("barrel_1", AgentKind::barrel, 3.0, 2.0)}));
  advance_to(ArrivalTime::from_utime(test::kStartUs + 1'000'000));
  const auto worlds = decoded<WorldMessage>(channel::kMrWorld);
  ASSERT_FALSE(worlds.empty());
  for (const WorldMessage& world : worlds) {
    EXPECT_EQ(world.robot, configuration_.robot.name);
    for (const WorldMessage::Entry& body : world.bodies) EXPECT_NE(body.owner, BodyOwner::real_robot);
  }
}

TEST_F(TickTest, TickPublishesOneScanPerScanForAnyInput) {
  start(test::configuration({agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander),
                             agent("person_1", AgentKind::person, -3, 0, BehaviourKind::wander)}));
  std::mt19937 random(7);
  auto log = test::drive(6);
  std::size_t scans = 0;
  for (std::size_t i = 0; i < log.size(); ++i) {
    Message each = log[i];
    const bool is_scan = each.channel == channel::kScan;
    scans += is_scan ? 1 : 0;
    // Everything but the scans is damaged at random: bits, length, stamps.
    if (!is_scan && random() % 2 == 0 && !each.payload.empty()) {
      each.payload[random() % each.payload.size()] ^= static_cast<std::uint8_t>(1U << (random() % 8));
      if (random() % 4 == 0) each.payload.resize(random() % each.payload.size());
    }
    feed(each);
    ASSERT_EQ(out_[channel::kMrScan].size(), scans);
    ASSERT_EQ(out_[channel::kMrScanInfo].size(), scans);
  }
  EXPECT_GT(state_->tally.refused_inputs, 0U);
}

TEST_F(TickTest, TickForwardsUnreadableScansWithTheReason) {
  start(test::configuration({agent("box_1", AgentKind::box, 3, 2)}));
  feed(test::drive(2));
  const Message whole = test::message(channel::kScan, test::kStartUs + 2'006'000, test::scan_at(2.0));
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
      {with(8, {0x7F, 0xF8, 0, 0, 0, 0, 0, 0}), "utime"}};  // NaN, for a sender that writes doubles
  const std::uint64_t before = state_->tally.scans_in;
  std::uint64_t count = 0;
  for (auto& [scan, reason] : bad) {
    scan.arrival = scan.arrival + microseconds(static_cast<std::int64_t>(++count));
    feed(scan);
    ASSERT_EQ(out_[channel::kMrScan].back(), scan.payload) << "unchanged, after " << count;
    const ScanInfo info = decoded<ScanInfo>(channel::kMrScanInfo).back();
    EXPECT_FALSE(info.live);
    EXPECT_TRUE(info.beam_agent.empty());
    EXPECT_NE(info.reason.find("SCAN"), std::string::npos) << info.reason;
    EXPECT_NE(info.reason.find(reason), std::string::npos) << info.reason;
    const bool has_stamp = scan.payload.size() >= 16 && reason != "utime";
    EXPECT_EQ(info.stamp.utime(), has_stamp ? test::kStartUs + 2'000'000 : scan.arrival.utime());
  }
  EXPECT_EQ(state_->tally.scans_in - before, count);
  EXPECT_EQ(state_->tally.scans_out, state_->tally.scans_in);
  EXPECT_EQ(out_[channel::kMrScan].size(), state_->tally.scans_in);
  EXPECT_EQ(state_->tally.scans_degraded[static_cast<std::size_t>(Degraded::unreadable)], count);
  // Later scans are processed normally.
  Message next = test::message(channel::kScan, test::kStartUs + 2'106'000, test::scan_at(2.1));
  feed(test::message(
      channel::kOdometry, test::kStartUs + 2'102'000,
      Odometry{SensorTime::from_utime(test::kStartUs + 2'100'000), test::pose_at(2.1).as<Odom, Base>()}));
  feed(next);
  EXPECT_TRUE(decoded<ScanInfo>(channel::kMrScanInfo).back().live);
}

TEST_F(TickTest, TickForwardsNoScanThatIsNotAsLongAsItDeclares) {
  start(test::configuration({}));
  feed(test::drive(2));
  const Message whole = test::message(channel::kScan, test::kStartUs + 2'006'000, test::scan_at(2.0));
  std::vector<Message> bad;
  for (std::size_t size = 0; size < whole.payload.size() + 100; ++size) {
    if (size == whole.payload.size()) continue;
    bad.push_back(whole);
    bad.back().payload.resize(size);
  }
  for (const std::uint8_t nranges : {0x00, 0x7F, 0xFF}) {
    bad.push_back(whole);
    std::fill_n(bad.back().payload.begin() + 16, 4, nranges);
  }
  const std::uint64_t before = state_->tally.scans_in, foreign = state_->tally.foreign_scans;
  const std::size_t scans = out_[channel::kMrScan].size();
  for (std::size_t i = 0; i < bad.size(); ++i) {
    bad[i].arrival = bad[i].arrival + microseconds(static_cast<std::int64_t>(i));
    feed(bad[i]);
    ASSERT_EQ(out_[channel::kMrScan].size(), scans) << bad[i].payload.size() << " bytes";
    const ScanInfo info = decoded<ScanInfo>(channel::kMrScanInfo).back();
    EXPECT_FALSE(info.live);
    EXPECT_NE(info.reason.find("SCAN"), std::string::npos) << info.reason;
  }
  EXPECT_EQ(state_->tally.scans_in, before);
  EXPECT_EQ(state_->tally.foreign_scans - foreign, bad.size());
}

TEST_F(TickTest, TickPublishesOneScanPerCorruptedScan) {
  start(test::configuration({agent("box_1", AgentKind::box, 3, 2)}));
  feed(test::drive(2));
  std::mt19937 random(5);
  std::int64_t arrival = test::kStartUs + 2'006'000;
  for (int round = 0; round < 3000; ++round) {
    Message scan = test::message(channel::kScan, ++arrival, test::scan_at(2.0));
    for (unsigned flips = 1 + random() % 4; flips > 0; --flips) {
      // A third of the flips hit the fields before the ranges.
      const std::size_t at = random() % (random() % 3 == 0 ? 20 : scan.payload.size());
      scan.payload[at] ^= static_cast<std::uint8_t>(1U << (random() % 8));
    }
    const std::size_t scans = out_[channel::kMrScan].size(), infos = out_[channel::kMrScanInfo].size();
    const std::uint64_t foreign = state_->tally.foreign_scans;
    feed(scan);
    ASSERT_EQ(out_[channel::kMrScanInfo].size(), infos + 1);
    const ScanInfo info = decoded<ScanInfo>(channel::kMrScanInfo).back();
    if (!has_form_of_scan(scan.payload)) {
      ASSERT_EQ(out_[channel::kMrScan].size(), scans) << "of another type";
      ASSERT_EQ(state_->tally.foreign_scans, foreign + 1);
      ASSERT_NE(info.reason.find("planar_lidar_t"), std::string::npos) << info.reason;
      ASSERT_EQ(info.stamp.utime(), scan.arrival.utime());
      continue;
    }
    ASSERT_EQ(out_[channel::kMrScan].size(), scans + 1);
    const auto& answer = out_[channel::kMrScan].back();
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
  lost.stamp = SensorTime::from_utime(test::kStartUs + 1'990'000);
  lost.state = SlamState::lost;
  lost.map_id = "synthetic";
  lost.covariance = PoseCovariance::Identity();
  feed(test::message(channel::kPoseCov, test::kStartUs + 2'000'000, lost));
  const Message scan = test::message(channel::kScan, test::kStartUs + 2'006'000, test::scan_at(2.0));
  feed(scan);
  EXPECT_EQ(out_[channel::kMrScan].back(), scan.payload);
  EXPECT_FALSE(decoded<ScanInfo>(channel::kMrScanInfo).back().live);
}

TEST_F(TickTest, TickPassesScansThroughForADifferentMap) {
  Configuration other = test::configuration({agent("box_1", AgentKind::box, 3, 2)});
  other.model.map_id = "another map";
  start(std::move(other));
  feed(test::drive(2));
  for (const ScanInfo& info : decoded<ScanInfo>(channel::kMrScanInfo)) EXPECT_FALSE(info.live);
}

TEST_F(TickTest, TickPassesThroughAScanWithAnHourStampError) {
  start(test::configuration({agent("box_1", AgentKind::box, 3, 2)}));
  feed(test::drive(2));
  Scan late = test::scan_at(2.0);
  late.stamp = late.stamp - seconds(3600);
  const Message scan = test::message(channel::kScan, test::kStartUs + 2'006'000, late);
  feed(scan);
  EXPECT_EQ(out_[channel::kMrScan].back(), scan.payload);
  Scan next = test::scan_at(2.1);
  feed(test::message(channel::kOdometry, test::kStartUs + 2'101'000,
                     Odometry{next.stamp, test::pose_at(2.1).as<Odom, Base>()}));
  feed(test::message(channel::kScan, test::kStartUs + 2'106'000, next));
  EXPECT_TRUE(decoded<ScanInfo>(channel::kMrScanInfo).back().live)
      << "one bad stamp must not blind what follows";
}

TEST_F(TickTest, TickWaitsForTheDepthImageOfTheSameMoment) {
  Configuration configuration = test::configuration({agent("box_1", AgentKind::box, 3, 2)});
  CameraIntrinsics lens;
  lens.width = 4;
  lens.height = 2;
  lens.fx = lens.fy = 4;
  configuration.robot.camera = CameraDescription{lens, {}, {}, 0, 0, 0, 0, ""};
  configuration.robot.depth = DepthCameraDescription{lens, {}, {}, 0.1, 8, {}, {}, {}, {}, {}, {}};
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
  const std::int64_t t = test::kStartUs + 1'990'000;
  feed(test::message(channel::kDepth, t - 30'000, image(PixelFormat::depth_mm, t - 33'000, 2)));
  feed(test::message(channel::kCamera, t + 2000, image(PixelFormat::bgr, t, 3)));
  EXPECT_TRUE(outputs_.frames().empty()) << "the depth image at hand shows an earlier moment";
  feed(test::message(channel::kDepth, t + 3000, image(PixelFormat::depth_mm, t, 2)));
  ASSERT_EQ(outputs_.frames().size(), 2U);
  EXPECT_EQ(outputs_.frames()[0].job.image.width, 0) << "the earlier depth image has no picture";
  ASSERT_TRUE(outputs_.frames()[1].job.depth.has_value());
  EXPECT_EQ(outputs_.frames()[1].job.depth->stamp, outputs_.frames()[1].job.image.stamp);

  feed(test::message(channel::kCamera, t + 35'000, image(PixelFormat::bgr, t + 33'000, 3)));
  EXPECT_TRUE(outputs_.frames().empty());
  outputs_.clear();
  advance(configuration_, ArrivalTime::from_utime(t + 95'000), *state_, outputs_, observer_);
  EXPECT_EQ(outputs_.frames().size(), 1U) << "no depth image came: not for long";
}

TEST_F(TickTest, AnImageShowsTheInstantThatItsTimeOffsetGives) {
  Configuration configuration = test::configuration({agent("box_1", AgentKind::box, 3, 2)});
  CameraDescription camera;
  camera.intrinsics.width = 4;
  camera.intrinsics.height = 2;
  camera.intrinsics.fx = camera.intrinsics.fy = 4;
  camera.time_offset = -0.4;
  configuration.robot.camera = camera;
  start(std::move(configuration));
  feed(test::drive(2));
  Image image;
  image.stamp = SensorTime::from_utime(test::kStartUs + 1'990'000);
  image.width = 4;
  image.height = 2;
  image.row_stride = 12;
  image.format = PixelFormat::bgr;
  image.bytes.assign(24, 7);
  feed(test::message(channel::kCamera, test::kStartUs + 1'992'000, image));
  ASSERT_EQ(outputs_.frames().size(), 1U);
  const auto& job = outputs_.frames()[0].job;
  EXPECT_EQ(job.image.stamp, image.stamp);
  const Eigen::Vector3d then = test::pose_at(1.59).translation(), now = test::pose_at(1.99).translation();
  ASSERT_GT((then - now).norm(), 0.05);
  EXPECT_LT((job.T_map_optical.translation() - then).norm(), 0.01);
}

}  // namespace
}  // namespace parhelion::tick
