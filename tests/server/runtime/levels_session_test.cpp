// A live session of a simulated robot on a bus: its log replays to the same bytes, also as a real robot's.
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <set>
#include <thread>

#include "server/runtime/loop.hpp"
#include "server/runtime/replay.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tests/server/tick/levels_fixture.hpp"
#include "tests/server/tick/same_bytes.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::runtime {
namespace {

using test::hazardous;
using test::level_1;

/// A live session at level 1 over a memory bus, driven for some seconds.
class LevelsSession : public testing::Test {
 protected:
  Report serve_and_drive(const tick::Configuration& configuration) {
    MemoryBusHub hub;
    const auto server = hub.connect(), console = hub.connect();
    EXPECT_TRUE(console->subscribe(channel::kOdometry, 10'000).ok());
    ServeOptions options;
    options.session = folder_ / "session.lcm";
    std::atomic<bool> stop = false;
    options.stop = [&stop] { return stop.load(); };
    std::optional<Result<Report>> report;
    std::thread thread([&] { report.emplace(serve(*server, configuration, options)); });
    Message incoming;
    for (int i = 0; i < 150; ++i) {  // three seconds of its odometry
      const auto received = console->receive(incoming, seconds(20));
      if (!received.ok() || !*received) break;
      if (i % 4 != 0) continue;
      const Message command =
          test::message(channel::kTeleop, 0, TwistCommand{{wall_now().ns}, {0.4, 0, 0.3}});
      EXPECT_TRUE(console->publish(command.channel, command.payload).ok());
    }
    stop = true;
    thread.join();
    EXPECT_TRUE(report->ok()) << report->error().message;
    return **report;
  }
  Result<Report> replay_session(std::optional<std::string> scenario = std::nullopt) {
    ReplayOptions again;
    again.log = folder_ / "session.lcm";
    again.session = folder_ / "again.lcm";
    again.overwrite = true;
    again.scenario = std::move(scenario);
    return replay(again);
  }

  test::TemporaryFolder folder_;
};

TEST_F(LevelsSession, TheSummaryLeavesOutWhatWasNotMeasured) {
  Report report = serve_and_drive(level_1());
  EXPECT_EQ(summary(report).find("us median"), std::string::npos) << summary(report);
  report.tally.frames_in = 0;
  EXPECT_EQ(summary(report).find("frames"), std::string::npos) << summary(report);
  report.tally.frames_in = 1;
  report.scan_us.add(40);
  EXPECT_NE(summary(report).find("frames  1 in"), std::string::npos) << summary(report);
  EXPECT_NE(summary(report).find("40 us median"), std::string::npos) << summary(report);
}

TEST_F(LevelsSession, TheSummaryDoesNotExplainWhyNothingWasInjected) {
  const Report report = serve_and_drive(level_1());
  EXPECT_GT(report.tally.scans_in, 0U);
  EXPECT_EQ(report.tally.scans_of_real_lasers, 0U);
  EXPECT_EQ(summary(report).find("because"), std::string::npos) << summary(report);
}

TEST_F(LevelsSession, ASimulatedSessionReplaysToTheSameBytes) {
  const Report live = serve_and_drive(
      level_1({test::agent("robot_1", AgentKind::robot, 2, 0, BehaviourKind::wander)}, hazardous()));
  EXPECT_GT(live.tally.scans_out, 50U);
  const auto replayed = replay_session();
  ASSERT_TRUE(replayed) << replayed.error().message;
  EXPECT_EQ(replayed->arrivals_corrected, 0U);
  EXPECT_EQ(replayed->hash, live.hash) << test::difference(folder_ / "session.lcm", folder_ / "again.lcm");
  for (const char* name :
       {channel::kScan, channel::kOdometry, channel::kImu, channel::kPoseCov, channel::kMrScan,
        channel::kMrCmd, channel::kMrEvents, channel::kHazard, channel::kCamera, channel::kMrCamera})
    EXPECT_TRUE(replayed->hash.contains(name)) << name;
  EXPECT_EQ(replayed->hash.at(channel::kMrCamera), replayed->hash.at(channel::kCamera))
      << "its bodies are in the picture: nothing is drawn twice";
  EXPECT_EQ(replayed->frames_dropped, live.frames_dropped) << "what live had no time for is not drawn now";
  EXPECT_EQ(live.tally.frames_out + live.frames_dropped, live.tally.frames_in);
  EXPECT_GT(live.tally.frames_out, 1U);
}

TEST_F(LevelsSession, ASimulatedRobotsSensorsReplayAsARealRecording) {
  serve_and_drive(level_1());
  std::ofstream(folder_ / "model.yaml") << to_yaml(test::room());
  std::ofstream(folder_ / "level3.yaml")
      << "name: again\nlevel: 3\nmodel: model.yaml\n"
         "agents: [{name: barrel_1, kind: barrel, pose: {x: 3 m, y: 0 m}}]\n";
  const auto replayed = replay_session(folder_ / "level3.yaml");
  ASSERT_TRUE(replayed) << replayed.error().message;
  const tick::Tally& tally = replayed->tally;
  EXPECT_GT(tally.scans_in, 50U);
  EXPECT_EQ(tally.scans_out, tally.scans_in);
  EXPECT_EQ(tally.refused_inputs, 0U) << tally.last_refusal;
  EXPECT_GT(tally.beams_replaced, 0U) << "the barrel is injected into them";
  EXPECT_GT(tally.frames_in, 1U) << "CAMERA is read back as a real camera's";
  EXPECT_EQ(tally.frames_out + replayed->frames_dropped, tally.frames_in)
      << "as live: a busy machine drops some";
  EXPECT_GT(tally.frames_composited, 0U) << "and the barrel is drawn into it";
  std::uint64_t degraded = 0;
  for (std::size_t why = 1; why < tick::kDegradedKinds; ++why) degraded += tally.scans_degraded[why];
  EXPECT_LE(degraded, 4U) << "but for the first ones";
}

}  // namespace
}  // namespace parhelion::runtime
