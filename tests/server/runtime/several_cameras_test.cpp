// Several cameras of one robot: a replay answers each image once, with the same bytes for any thread count.
#include "tests/server/tick/several_cameras.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "server/runtime/replay.hpp"
#include "tests/server/tick/same_bytes.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::runtime {
namespace {

using namespace test;

class SeveralCamerasReplayTest : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "model.yaml") << to_yaml(room());
    std::ofstream(folder_ / "robot.yaml") << to_yaml(robot_with_two_cameras());
    Scenario scenario;
    scenario.model = folder_ / "model.yaml";
    scenario.robot = folder_ / "robot.yaml";
    scenario.agents = {agent("barrel_1", AgentKind::barrel, 0, 0),
                       agent("robot_1", AgentKind::robot, 1, 2, BehaviourKind::wander)};
    std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
    std::vector<Message> images;
    for (std::int64_t t = 550'000; t < 2'900'000; t += 100'000) {
      images.push_back(image_at(kStartUs + t));
      images.push_back(left_image_at(kStartUs + t + 20'000));
      images.push_back(left_depth_at(kStartUs + t + 20'000));
    }
    write_log(folder_ / "drive.lcm", drive(3, std::move(images)));
  }
  Report run(const std::string& session, int threads) {
    ReplayOptions options;
    options.log = folder_ / "drive.lcm";
    options.scenario = folder_ / "scenario.yaml";
    options.session = folder_ / session;
    options.threads = threads;
    auto report = replay(options);
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    return report.ok() ? *report : Report{};
  }
  TemporaryFolder folder_;
};

TEST_F(SeveralCamerasReplayTest, EachImageIsAnsweredOnceWithTheSameBytesForAnyThreadCount) {
  const Report first = run("a.lcm", 1);
  EXPECT_EQ(first.tally.frames_in, 48U);
  EXPECT_EQ(first.tally.frames_out, 48U);
  EXPECT_GT(first.tally.frames_composited, 0U);
  auto payloads = payloads_by_channel(folder_ / "a.lcm");
  for (const char* name : {"MR_CAMERA", "MR_CAMERA_left", "MR_DEPTH_left"})
    EXPECT_EQ(payloads[name].size(), 24U) << name;
  EXPECT_TRUE(payloads["MR_DEPTH"].empty());
  for (const int threads : {2, 8}) {
    const std::string session = "b" + std::to_string(threads) + ".lcm";
    EXPECT_EQ(run(session, threads).hash, first.hash)
        << threads << difference(folder_ / "a.lcm", folder_ / session);
  }
}

}  // namespace
}  // namespace parhelion::runtime
