// The video shows the same agents as the scans.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using test::TickTest;

bool draws(const render::RenderJob& job, const std::string& entity) {
  bool found = false;
  for_each_body(job.world, [&](const BodyDefinition& definition, const BodyState&) {
    found = found || definition.entity == entity;
  });
  return found;
}

/// A drive with an image between any two scans; the n-th SLAM estimate has the uncertainty `sigma` (m).
template <class Sigma>
std::vector<Message> uncertain_drive(double duration, const Sigma& sigma) {
  std::vector<Message> images;
  for (std::int64_t t = 50'000; t < duration * 1e6; t += 100'000)
    images.push_back(test::image_at(test::kStartUs + t));
  auto log = test::drive(duration, images);
  int word = 0;
  for (Message& each : log) {
    if (each.channel != channel::kPoseCov) continue;
    PoseEstimate estimate;
    EXPECT_TRUE(decode(each.channel, each.payload, estimate).ok());
    estimate.covariance.setZero();
    estimate.covariance.diagonal().head<2>().setConstant(std::pow(sigma(word++), 2));
    encode(estimate, each.payload);
  }
  return log;
}

TEST_F(TickTest, AnAgentHiddenInTheScanIsHiddenInVideo) {
  Configuration configuration = test::configuration({test::agent("box_1", AgentKind::box, 3, 0)});
  configuration.robot = test::robot_with_camera();
  start(configuration);
  bool in_scan = false, in_frame = false;
  int scans_with = 0, frames_with = 0, frames = 0, changes = 0;
  // Within a fifth of the limit of 0.10 m, varying.
  for (const Message& each :
       uncertain_drive(5, [](int word) { return 0.095 + 0.012 * std::sin(0.9 * word); })) {
    feed(each);
    for (const Outputs::Entry& entry : outputs_.entries()) {
      if (entry.channel != channel::kMrScanInfo) continue;
      in_scan = decoded<ScanInfo>(channel::kMrScanInfo).back().live;
      scans_with += in_scan ? 1 : 0;
    }
    for (const Outputs::Frame& frame : outputs_.frames()) {
      if (!frame.reason.empty()) continue;
      const bool drawn = draws(frame.job, "box_1");
      EXPECT_TRUE(in_scan || !drawn || scans_with == 0) << "frame " << frames;
      changes += frames > 0 && drawn != in_frame ? 1 : 0;
      in_frame = drawn;
      frames_with += drawn ? 1 : 0;
      ++frames;
    }
  }
  EXPECT_GT(frames, 40);
  EXPECT_GT(scans_with, 0);
  EXPECT_GT(frames_with, 0);
  EXPECT_LE(changes, 1) << "it goes, and does not blink";
}

TEST_F(TickTest, AnAgentReturnsWhenTheErrorIsClearlySmall) {
  Configuration configuration = test::configuration({test::agent("box_1", AgentKind::box, 3, 0)});
  configuration.robot = test::robot_with_camera();
  start(configuration);
  feed(uncertain_drive(5, [](int word) { return word < 10 || word > 25 ? 0.01 : 0.3; }));
  std::vector<bool> live;
  for (const ScanInfo& info : decoded<ScanInfo>(channel::kMrScanInfo)) live.push_back(info.live);
  ASSERT_GT(live.size(), 45U);
  EXPECT_TRUE(live[9]);
  EXPECT_FALSE(live[20]);
  EXPECT_TRUE(live.back());
}

DepthCameraDescription small_depth_camera() {
  DepthCameraDescription depth;
  depth.intrinsics = {64, 48, 60, 60, 32, 24, {}, {}};
  depth.T_base_optical = {Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), {0.2, 0, 0.4}};
  return depth;
}

/// A depth image of a wall 4 m away, which arrives 5 ms after its stamp.
Message depth_at(std::int64_t us) {
  return test::message(channel::kDepth, us + 5000, test::depth_of_a_wall(us));
}

/// How often each depth image is published by a job, by its stamp (us).
class DepthAnswers {
 public:
  void add(Outputs& outputs) {
    for (const Outputs::Frame& frame : outputs.frames()) {
      if (!frame.job.depth || frame.job.depth_answered) continue;
      ++times_[frame.job.depth->stamp.utime()];
      unchanged_ += frame.reason.empty() ? 0 : 1;
    }
  }
  std::size_t images() const { return times_.size(); }
  int unchanged() const { return unchanged_; }
  bool once_each() const {
    return std::all_of(times_.begin(), times_.end(), [](const auto& each) { return each.second == 1; });
  }

 private:
  std::map<std::int64_t, int> times_;
  int unchanged_ = 0;
};

TEST_F(TickTest, DepthImagesOfARobotWithoutACameraAreAnswered) {
  Configuration configuration = test::configuration({test::agent("box_1", AgentKind::box, 3, 0)});
  configuration.robot.depth = small_depth_camera();
  start(configuration);
  std::vector<Message> images;
  for (std::int64_t t = 1'050'000; t < 4'000'000; t += 100'000)
    images.push_back(depth_at(test::kStartUs + t));
  DepthAnswers answers;
  for (const Message& each : test::drive(4, images)) {
    feed(each);
    answers.add(outputs_);
    for (const Outputs::Frame& frame : outputs_.frames()) {
      EXPECT_TRUE(frame.job.image.bytes.empty());
      EXPECT_EQ(frame.reason, "");
      EXPECT_TRUE(draws(frame.job, "box_1"));
    }
  }
  EXPECT_EQ(answers.images(), images.size());
  EXPECT_TRUE(answers.once_each());
}

TEST_F(TickTest, EachDepthImageIsAnsweredOnceWhateverTheRateOfTheCamera) {
  for (const std::int64_t period : {40'000, 100'000, 330'000}) {
    Configuration configuration = test::configuration({test::agent("box_1", AgentKind::box, 3, 0)});
    configuration.robot = test::robot_with_camera();
    configuration.robot.depth = small_depth_camera();
    start(configuration);
    std::vector<Message> images;
    for (std::int64_t t = 1'000'000; t < 4'000'000; t += period)
      images.push_back(test::image_at(test::kStartUs + t));
    std::size_t depth_images = 0;
    for (std::int64_t t = 1'050'000; t < 3'700'000; t += 100'000, ++depth_images)
      images.push_back(depth_at(test::kStartUs + t));
    DepthAnswers answers;
    std::size_t pictures = 0;
    for (const Message& each : test::drive(4, images)) {
      feed(each);
      answers.add(outputs_);
      for (const Outputs::Frame& frame : outputs_.frames()) pictures += !frame.job.image.bytes.empty();
    }
    EXPECT_EQ(answers.images(), depth_images) << period;
    EXPECT_TRUE(answers.once_each()) << period;
    EXPECT_GE(pictures + 1, images.size() - depth_images) << period;
  }
}

TEST_F(TickTest, ADepthImageWithoutADescriptionIsPublishedWithTheReason) {
  start(test::configuration({}));
  feed(test::drive(1));
  DepthAnswers answers;
  feed(depth_at(test::kStartUs + 1'000'000));
  answers.add(outputs_);
  EXPECT_EQ(answers.images(), 1U);
  EXPECT_EQ(answers.unchanged(), 1);
}

}  // namespace
}  // namespace parhelion::tick
