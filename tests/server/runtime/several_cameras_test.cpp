// Several cameras of one robot: a replay answers each image once, with the same bytes for any thread count.
#include "tests/server/tick/several_cameras.hpp"

#include <gtest/gtest.h>

#include "tests/server/runtime/replay_fixture.hpp"

namespace parhelion::runtime {
namespace {

using namespace test;

class SeveralCamerasReplayTest : public ReplayFixture {
 protected:
  void SetUp() override {
    Scenario scenario;
    scenario.model = folder_ / "model.yaml";
    scenario.robot = folder_ / "robot.yaml";
    scenario.agents = {agent("barrel_1", AgentKind::barrel, 0, 0),
                       agent("robot_1", AgentKind::robot, 1, 2, BehaviourKind::wander)};
    std::vector<Message> images;
    for (std::int64_t t = 550'000; t < 2'900'000; t += 100'000) {
      images.push_back(image_at(kStartUs + t));
      images.push_back(left_image_at(kStartUs + t + 20'000));
      images.push_back(left_depth_at(kStartUs + t + 20'000));
    }
    write(scenario, robot_with_two_cameras(), drive(3, std::move(images)));
  }
};

TEST_F(SeveralCamerasReplayTest, EachImageIsAnsweredOnceWithTheSameBytesForAnyThreadCount) {
  const Report first = run(options("a.lcm"));
  EXPECT_EQ(first.tally.frames_in, 48U);
  EXPECT_EQ(first.tally.frames_out, 48U);
  EXPECT_GT(first.tally.frames_composited, 0U);
  auto payloads = payloads_by_channel(folder_ / "a.lcm");
  for (const char* name : {"MR_CAMERA", "MR_CAMERA_left", "MR_DEPTH_left"})
    EXPECT_EQ(payloads[name].size(), 24U) << name;
  EXPECT_TRUE(payloads["MR_DEPTH"].empty());
  expect_same_bytes_for_any_thread_count(first);
}

}  // namespace
}  // namespace parhelion::runtime
