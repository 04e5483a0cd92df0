// Several cameras and depth cameras of one robot: each image is answered once, on its own camera's channels,
// with the world as that camera sees it.
#include "tests/server/tick/several_cameras.hpp"

#include <gmock/gmock.h>

#include "server/tick/frame_path.hpp"
#include "tests/server/tick/levels_fixture.hpp"

namespace parhelion::tick {
namespace {

using namespace test;
using testing::HasSubstr;

class SeveralCamerasTest : public LevelsTest {
 protected:
  void start_session(const RobotDescription& robot = robot_with_two_cameras()) {
    Scenario scenario;
    scenario.agents = {agent("barrel_1", AgentKind::barrel, 0, 0)};
    auto made = configure(scenario, robot, room());
    ASSERT_TRUE(made.ok()) << made.error().message;
    start(*made);
  }
  /// Feeds the synthetic drive with these images, and keeps the frames.
  void drive_with(std::vector<Message> images, double duration = 4) {
    for (const Message& each : drive(duration, std::move(images))) {
      feed(each);
      keep_frames();
    }
    outputs_.clear();
    finish(configuration_, *state_, outputs_);
    keep_frames();
  }
  void keep_frames() {
    for (Outputs::Frame& frame : outputs_.frames()) frames_[frame.camera].push_back(std::move(frame));
  }

  std::map<std::size_t, std::vector<Outputs::Frame>> frames_;  // by camera
};

TEST_F(SeveralCamerasTest, EachImageIsAnsweredOnceWithTheWorldAsItsCameraSeesIt) {
  start_session();
  std::vector<Message> images;
  for (std::int64_t t = 1'050'000; t < 3'900'000; t += 100'000) {
    images.push_back(image_at(kStartUs + t));
    images.push_back(left_image_at(kStartUs + t + 20'000));
    images.push_back(left_depth_at(kStartUs + t + 20'000));
  }
  drive_with(std::move(images));
  for (std::size_t camera : {0U, 1U}) {
    ASSERT_EQ(frames_[camera].size(), 29U) << camera;
    for (const Outputs::Frame& frame : frames_[camera]) {
      EXPECT_EQ(frame.reason, "");
      EXPECT_EQ(frame.job.depth.has_value(), camera == 1) << "the depth image of its own camera";
      EXPECT_FALSE(frame.job.depth_answered);
      const double t = (frame.job.image.stamp - SensorTime::from_utime(kStartUs)).seconds();
      const auto optical = pose_at(t) * configuration_.robot.camera_at(camera)->T_base_optical;
      EXPECT_LT((frame.job.T_map_optical.translation() - optical.translation()).norm(), 0.001);
      EXPECT_TRUE(frame.job.T_map_optical.rotation().isApprox(optical.rotation(), 1e-3));
      if (camera == 0) continue;
      const auto at_depth = pose_at(t) * configuration_.robot.depth_at(1)->T_base_optical;
      EXPECT_LT((frame.job.T_map_depth.translation() - at_depth.translation()).norm(), 0.001);
    }
  }
  EXPECT_EQ(state_->tally.frames_in, 58U);
}

TEST_F(SeveralCamerasTest, AnAnswerIsPublishedOnTheChannelsOfItsCamera) {
  start_session();
  FrameAnswer done;
  done.camera = 1;
  done.answer.image.width = 64;
  done.answer.depth.emplace();
  Outputs outputs;
  publish_frame(configuration_, done, outputs, state_->tally);
  std::vector<std::string> channels;
  for (const Outputs::Entry& entry : outputs.entries()) channels.push_back(entry.channel);
  EXPECT_THAT(channels, testing::ElementsAre("MR_CAMERA_left", "MR_DEPTH_left"));
}

// Of a depth camera alone there is no picture.
TEST_F(SeveralCamerasTest, ADepthImageWithBodiesCountsAsAFrameWithThem) {
  start_session();
  FrameAnswer done;
  done.answer.depth.emplace();
  Outputs outputs;
  publish_frame(configuration_, done, outputs, state_->tally);
  EXPECT_EQ(state_->tally.frames_composited, 0U);
  done.answer.depth_drawn = true;
  publish_frame(configuration_, done, outputs, state_->tally);
  EXPECT_EQ(state_->tally.frames_composited, 1U);
}

TEST_F(SeveralCamerasTest, ADepthCameraWithoutACameraIsAnsweredAlone) {
  RobotDescription robot = robot_with_two_cameras();
  robot.further_cameras.front().camera.reset();
  start_session(robot);
  std::vector<Message> images;
  for (std::int64_t t = 1'050'000; t < 3'000'000; t += 100'000) images.push_back(left_depth_at(kStartUs + t));
  const std::size_t sent = images.size();
  drive_with(std::move(images));
  EXPECT_TRUE(frames_[0].empty());
  ASSERT_EQ(frames_[1].size(), sent);
  for (const Outputs::Frame& frame : frames_[1]) {
    EXPECT_EQ(frame.reason, "");
    EXPECT_TRUE(frame.job.depth.has_value());
    EXPECT_FALSE(frame.job.depth_answered);
  }
}

/// The first camera's jobs stay as they were, whatever the other sends.
TEST_F(SeveralCamerasTest, ImagesOfAnotherClockComeBackWithTheReasonAndHarmNoOther) {
  start_session();
  std::vector<Message> images;
  for (std::int64_t t = 1'050'000; t < 3'900'000; t += 100'000) {
    images.push_back(image_at(kStartUs + t));
    images.push_back(left_image_at(kStartUs + t + 20'000, t > 2'000'000 ? 10'000'000 : 0));
  }
  drive_with(std::move(images));
  for (const Outputs::Frame& frame : frames_[0]) EXPECT_EQ(frame.reason, "");
  ASSERT_EQ(frames_[0].size(), 29U);
  ASSERT_EQ(frames_[1].size(), 29U);
  for (const Outputs::Frame& frame : frames_[1]) {
    const bool late = frame.job.image.stamp > SensorTime::from_utime(kStartUs + 8'000'000);
    EXPECT_EQ(frame.reason, late ? "the stamp is off the robot's clock" : "");
  }
}

TEST_F(SeveralCamerasTest, AnImageOfADepthCameraAloneComesBackUnchanged) {
  RobotDescription robot = robot_with_two_cameras();
  robot.further_cameras.front().camera.reset();
  start_session(robot);
  drive_with({left_image_at(kStartUs + 1'050'000)}, 2);
  ASSERT_EQ(frames_[1].size(), 1U);
  EXPECT_THAT(frames_[1].front().reason, HasSubstr("no camera calibration"));
}

TEST_F(SeveralCamerasTest, ASimulatedRobotHasAllOfItsCameras) {
  Configuration configuration = level_1();
  simulation::RobotModel model = *configuration.robot_models.front();
  NamedCameras rear;
  rear.name = "rear";
  rear.camera = model.description.camera;
  rear.camera->rate = 5;
  model.description.further_cameras = {rear};
  auto made =
      configure(configuration.scenario, {}, room(), {std::make_shared<const simulation::RobotModel>(model)});
  ASSERT_TRUE(made.ok()) << made.error().message;
  start(*made);
  while (state_->simulation.now() < SimulationTime{kStartUs * 1000} + seconds(2.0)) {
    outputs_.clear();
    advance(configuration_, ArrivalTime{state_->simulation.next_step().ns}, *state_, outputs_, observer_);
    keep_frames();
  }
  EXPECT_NEAR(static_cast<double>(frames_[0].size()), 2 * 15, 1);
  EXPECT_NEAR(static_cast<double>(frames_[1].size()), 2 * 5, 1);
  FrameAnswer done;
  done.simulated = true;
  done.camera = 1;
  done.answer.image.bytes = {1};
  Outputs outputs;
  publish_frame(configuration_, done, outputs, state_->tally);
  ASSERT_EQ(outputs.entries().size(), 2U);
  EXPECT_EQ(outputs.entries()[0].channel, "CAMERA_rear");
  EXPECT_EQ(outputs.entries()[1].channel, "MR_CAMERA_rear");
}

}  // namespace
}  // namespace parhelion::tick
