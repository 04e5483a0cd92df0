// Images of agents' cameras in live sessions: replay produces the same bytes, and a pause produces no images.
#include <gtest/gtest.h>

#include "tests/server/runtime/loop_fixture.hpp"
#include "tests/server/tick/level_1.hpp"
#include "tests/server/tick/small_camera.hpp"

namespace parhelion::runtime {
namespace {

const std::string kRoverPictures = "MR_AGENT_rover_1_CAMERA";

std::vector<AgentDefinition> agents() {
  AgentDefinition rover = test::agent("rover_1", AgentKind::robot, -3, -1, BehaviourKind::wander);
  rover.model = "rover";
  rover.camera_rate = 8;
  return {rover, test::agent("person_1", AgentKind::person, 2, 1, BehaviourKind::wander)};
}

using AgentCamerasSession = test::LoopTest;

TEST_F(AgentCamerasSession, ReplaysToTheSameBytesWithAnyNumberOfThreads) {
  Scenario scenario;
  scenario.name = "filmed";
  scenario.agents = agents();
  const auto configuration =
      tick::configure(scenario, test::robot(), test::room(), {test::small_camera("rover", 64, 48)});
  ASSERT_TRUE(configuration) << configuration.error().message;
  serve_in_background(*configuration);
  EXPECT_EQ(await(kRoverPictures, 8).size(), 8U);
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  const Report& live = **report_;
  EXPECT_EQ(live.tally.agent_frames_in, live.tally.agent_frames_out + live.agent_frames_dropped);
  EXPECT_GE(live.tally.agent_frames_out, 8U);
  expect_same_bytes_again(live);
  ReplayOptions again;
  again.log = folder_ / "session.lcm";
  for (const int threads : {1, 4}) {
    again.threads = threads;
    const auto replayed = replay(again);
    ASSERT_TRUE(replayed) << replayed.error().message;
    EXPECT_EQ(replayed->hash, live.hash) << threads;
    EXPECT_EQ(replayed->agent_frames_dropped, live.agent_frames_dropped);
  }
}

TEST_F(AgentCamerasSession, TakesNoneWhileItIsPaused) {
  auto clock = std::make_shared<SessionClock>();
  options_.clock = clock;
  const auto configuration = tick::configure(test::level_1(agents()).scenario, {}, test::room(),
                                             {test::small_camera("rover", 64, 48)});
  ASSERT_TRUE(configuration) << configuration.error().message;
  serve_in_background(*configuration);
  ASSERT_EQ(await(kRoverPictures, 3).size(), 3U);
  clock->set_rate(0);
  const std::int64_t paused = clock->now().ns;
  EXPECT_EQ(await(channel::kMrStatus, 2).size(), 2U) << "more than a second of real time";
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  for (const Message& each : session_log()) {
    if (each.channel != kRoverPictures) continue;
    EXPECT_LE(leading_stamp(each.payload)->ns, paused);
  }
  expect_same_bytes_again(**report_);
}

}  // namespace
}  // namespace parhelion::runtime
