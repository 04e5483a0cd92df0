// The depth camera of a simulated robot publishes DEPTH like a real one.
#include <gtest/gtest.h>

#include <cmath>

#include "render/depth_image.hpp"
#include "server/runtime/render_thread.hpp"
#include "tests/server/runtime/drawn_frames.hpp"
#include "tests/server/tick/levels_fixture.hpp"

namespace parhelion::runtime {
namespace {

using test::LevelsTest;

/// The rover with a small depth camera at its camera's mount, at a third of its rate.
tick::Configuration with_depth(std::vector<AgentDefinition> agents = {}) {
  tick::Configuration configuration = test::level_1(std::move(agents));
  DepthCameraDescription& depth = configuration.robot.depth.emplace();
  const CameraDescription& camera = *configuration.robot.camera;
  depth.intrinsics.width = 80, depth.intrinsics.height = 60;
  depth.intrinsics.fx = depth.intrinsics.fy = 66;
  depth.intrinsics.cx = 39.5, depth.intrinsics.cy = 29.5;
  depth.T_base_optical = camera.T_base_optical.as<Base, DepthOptical>();
  depth.range_min = 0.4, depth.range_max = 10;
  depth.rate = 5;
  return configuration;
}

class LevelsDepth : public LevelsTest {
 protected:
  /// Steps for `duration` s; every frame is rendered at once, as in a replay.
  void watch(double duration) {
    RenderThread renderer(configuration_.model, true, 0);
    ASSERT_EQ(renderer.fault(), "");
    for (int step = 0; step < std::lround(duration * 240); ++step) {
      outputs_.clear();
      tick::advance(configuration_, ArrivalTime{state_->simulation.next_step().ns}, *state_, outputs_,
                    observer_);
      auto frames = std::move(outputs_.frames());
      for (tick::Outputs::Frame& frame : frames) {
        stamps_.push_back(frame.job.image.stamp);
        poses_.push_back(frame.job.T_map_depth);
        ASSERT_NO_FATAL_FAILURE(
            test::draw_frame(renderer, std::move(frame), configuration_, state_->tally, outputs_));
        keep_outputs();
      }
    }
  }

  std::vector<SensorTime> stamps_;
  std::vector<Transform<Map, DepthOptical>> poses_;
};

TEST_F(LevelsDepth, DepthIsPublishedWithItsPicturesAndAsMrDepth) {
  start(with_depth());
  watch(1);
  EXPECT_NEAR(static_cast<double>(out_[channel::kCamera].size()), 15, 1);
  ASSERT_NEAR(static_cast<double>(out_[channel::kDepth].size()), 5, 1);
  EXPECT_EQ(out_[channel::kMrDepth], out_[channel::kDepth])
      << "its bodies are in it: nothing is put in twice";
  EXPECT_EQ(state_->tally.frames_out, state_->tally.frames_in);
  std::vector<SensorTime> pictures;
  for (const Image& image : decoded<Image>(channel::kCamera)) pictures.push_back(image.stamp);
  for (const Image& image : decoded<Image>(channel::kDepth)) {
    EXPECT_EQ(image.format, PixelFormat::depth_mm);
    EXPECT_EQ(image.width, 80);
    EXPECT_EQ(image.height, 60);
    EXPECT_NE(std::find(pictures.begin(), pictures.end(), image.stamp), pictures.end());
  }
}

TEST_F(LevelsDepth, DepthPointsLieOnModelWallsAndAgents) {
  start(with_depth({test::agent("box_1", AgentKind::box, 0, 0.3)}));
  watch(0.3);
  const auto images = decoded<Image>(channel::kDepth);
  ASSERT_FALSE(images.empty());
  const DepthCameraDescription& camera = *configuration_.robot.depth;
  const auto taken = std::find(stamps_.begin(), stamps_.end(), images.back().stamp);
  ASSERT_NE(taken, stamps_.end());
  const auto& T_map_optical = poses_[static_cast<std::size_t>(taken - stamps_.begin())];
  const auto pixels = render::decode_depth(images.back());
  ASSERT_TRUE(pixels) << pixels.error().message;
  int on_box = 0, on_floor = 0, on_wall = 0, elsewhere = 0;
  for (int v = 0; v < pixels->height; ++v) {
    for (int u = 0; u < pixels->width; ++u) {
      const double z = 0.001 * pixels->millimetres[static_cast<std::size_t>(v * pixels->width + u)];
      if (z == 0) continue;
      const CameraIntrinsics& k = camera.intrinsics;
      const Eigen::Vector3d p =
          T_map_optical * Eigen::Vector3d((u - k.cx) / k.fx * z, (v - k.cy) / k.fy * z, z);
      const bool box = std::abs(p.x()) < 0.21 && std::abs(p.y() - 0.3) < 0.21;
      if (box && p.z() > 0.02)
        ++on_box;
      else if (std::abs(p.z()) < 0.01)
        ++on_floor;
      else if (std::any_of(configuration_.model.entities.begin(), configuration_.model.entities.end(),
                           [&](const ModelEntity& wall) {
                             const Eigen::Vector3d q = wall.T_map_body.inverse() * p;
                             return ((q.cwiseAbs() - wall.size / 2).array() < 0.01).all();
                           }))
        ++on_wall;
      else
        ++elsewhere;
    }
  }
  EXPECT_GT(on_box, 50);
  EXPECT_GT(on_floor, 500);
  EXPECT_GT(on_wall, 500);
  EXPECT_EQ(elsewhere, 0);
}

TEST_F(LevelsDepth, ARobotWithOnlyADepthCameraSendsOnlyDepth) {
  tick::Configuration configuration = with_depth();
  configuration.robot.camera.reset();
  start(std::move(configuration));
  watch(1);
  EXPECT_TRUE(out_[channel::kCamera].empty());
  EXPECT_NEAR(static_cast<double>(out_[channel::kDepth].size()), 5, 1);
  EXPECT_EQ(state_->tally.frames_out, out_[channel::kDepth].size());
}

TEST_F(LevelsDepth, AMissingHeadIsRefusedByName) {
  tick::Configuration configuration = with_depth();
  configuration.robot.depth->head.push_back({"mast_pan", {}, Eigen::Vector3d::UnitZ()});
  start(std::move(configuration));
  watch(0.3);
  EXPECT_TRUE(out_[channel::kDepth].empty());
  EXPECT_NE(state_->tally.last_refusal.find("mast_pan"), std::string::npos) << state_->tally.last_refusal;
}

}  // namespace
}  // namespace parhelion::runtime
