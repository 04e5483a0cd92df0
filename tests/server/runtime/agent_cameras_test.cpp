// Images of a virtual robot's camera are published on MR_AGENT_<name>_CAMERA.
#include <gmock/gmock.h>

#include <set>

#include "render/jpeg.hpp"
#include "server/runtime/render_thread.hpp"
#include "tests/server/runtime/drawn_frames.hpp"
#include "tests/server/tick/small_camera.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::runtime {
namespace {

using testing::HasSubstr;

constexpr int kWidth = 64, kHeight = 48;
const std::string kPictures = "MR_AGENT_rover_1_CAMERA";

/// The rover with small camera images, heading along x from `x` on the map's x axis.
AgentDefinition rover(double x, double rate = 5) {
  AgentDefinition agent = test::agent("rover_1", AgentKind::robot, x, 0);
  agent.model = "rover";
  agent.camera_rate = rate;
  return agent;
}

tick::Configuration with_rovers(std::vector<AgentDefinition> agents, Scenario scenario = {}) {
  scenario.agents = std::move(agents);
  auto made =
      tick::configure(scenario, test::robot(), test::room(), {test::small_camera("rover", kWidth, kHeight)});
  EXPECT_TRUE(made) << made.error().message;
  return *made;
}

class AgentCamerasTest : public test::TickTest {
 protected:
  /// Feeds messages; every frame is rendered at once, as in a replay on one thread.
  void watch(const std::vector<Message>& log) {
    if (!renderer_) renderer_.emplace(configuration_.model, true, 0);
    ASSERT_EQ(renderer_->fault(), "");
    for (const Message& each : log) {
      feed(each);
      draw();
    }
  }
  void draw() {
    auto frames = std::move(outputs_.frames());
    for (tick::Outputs::Frame& frame : frames) {
      if (frame.agent.empty()) continue;
      stamps_[frame.agent].push_back(frame.job.image.stamp);
      ASSERT_NO_FATAL_FAILURE(
          test::draw_frame(*renderer_, std::move(frame), configuration_, state_->tally, outputs_));
      keep_outputs();
    }
  }
  /// The last image of the first rover's camera in a scene with these agents.
  std::vector<std::uint8_t> seen(std::vector<AgentDefinition> agents, SemanticModel model = test::room()) {
    tick::Configuration configuration = with_rovers(std::move(agents));
    configuration.model = std::move(model);
    return seen(std::move(configuration));
  }
  std::vector<std::uint8_t> seen(tick::Configuration configuration) {
    renderer_.reset();
    out_.clear();
    start(std::move(configuration));
    watch(test::drive(1));
    const auto all = decoded<Image>(kPictures);
    std::vector<std::uint8_t> bgr;
    if (all.empty() || !render::JpegCodec().decode(all.back().bytes, bgr).ok()) ADD_FAILURE() << "no picture";
    return bgr;
  }
  Event answer_to(InstructorCommand command, double at) {
    set_request(command, {}, ++requests_);
    watch(
        {test::message(channel_of(command), test::kStartUs + static_cast<std::int64_t>(at * 1e6), command)});
    for (const Event& event : decoded<Event>(channel::kMrEvents)) {
      if (event.request == requests_ &&
          (event.kind == EventKind::command_accepted || event.kind == EventKind::command_refused))
        return event;
    }
    ADD_FAILURE() << "no answer";
    return {};
  }
  Event order_camera(const std::string& name, double rate, double at) {
    return answer_to(CameraRate{.agent = name, .rate = rate}, at);
  }
  /// Does the steps until `t` seconds after the start.
  void run(double t) {
    outputs_.clear();
    tick::advance(configuration_,
                  ArrivalTime::from_utime(test::kStartUs + static_cast<std::int64_t>(t * 1e6)), *state_,
                  outputs_, observer_);
    draw();
  }

  std::optional<RenderThread> renderer_;
  std::map<std::string, std::vector<SensorTime>> stamps_;
  std::uint64_t requests_ = 0;
};

int blue_of(const std::vector<std::uint8_t>& bgr, int u, int v) {
  return bgr[static_cast<std::size_t>(3 * (v * kWidth + u))];
}

/// Columns and rows in which two images differ by more than noise and coding.
struct Differing {
  std::set<int> columns, rows;
};

Differing differing(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  Differing all;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (std::abs(a[i] - b[i]) < 40) continue;
    all.columns.insert(static_cast<int>(i / 3) % kWidth);
    all.rows.insert(static_cast<int>(i / 3) / kWidth);
  }
  return all;
}

TEST_F(AgentCamerasTest, PublishAtTheirRateWithTheirCaptureStamps) {
  start(with_rovers({rover(-3)}));
  watch(test::drive(2));
  const auto all = decoded<Image>(kPictures);
  EXPECT_NEAR(static_cast<double>(all.size()), 10, 1);
  EXPECT_EQ(state_->tally.agent_frames_in, all.size());
  EXPECT_EQ(state_->tally.agent_frames_out, all.size());
  EXPECT_EQ(state_->tally.frames_in, 0U) << "those are the trainee's robot's";
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].stamp.utime(), stamps_["rover_1"][i].utime());
    EXPECT_EQ(all[i].format, PixelFormat::mjpeg);
    EXPECT_EQ(all[i].width, kWidth);
    if (i == 0) continue;
    EXPECT_NEAR((all[i].stamp - all[i - 1].stamp).seconds(), 0.2, 0.005);
  }
}

TEST_F(AgentCamerasTest, SeeTheWallAheadDownToTheFloor) {
  const auto room = seen({rover(-3)});
  // The wall at x = 4.95 m is 8.05 m away, its foot 0.6 m under the camera.
  const CameraIntrinsics& k = configuration_.robot_models.front()->description.camera->intrinsics;
  const int foot = static_cast<int>(std::lround(k.cy + k.fy * 0.6 / 8.05));
  EXPECT_GT(blue_of(room, kWidth / 2, foot - 3), blue_of(room, kWidth / 2, foot + 3) + 20);
  const auto open = seen({rover(-3)}, SemanticModel{});
  EXPECT_FALSE(differing(room, open).columns.empty());
}

TEST_F(AgentCamerasTest, SeeAgentsInFrontButNotBehindAWall) {
  const auto alone = seen({rover(-3)});
  const auto before = differing(alone, seen({rover(-3), test::agent("box", AgentKind::box, -1.5, 0)}));
  ASSERT_FALSE(before.columns.empty());
  EXPECT_NEAR((*before.columns.begin() + *before.columns.rbegin()) / 2.0, kWidth / 2.0, 4);
  const auto left = differing(alone, seen({rover(-3), test::agent("box", AgentKind::box, -1, 0.6)}));
  ASSERT_FALSE(left.columns.empty());
  EXPECT_LT(*left.columns.rbegin(), kWidth / 2) << "y points to the left";
  EXPECT_EQ(alone, seen({rover(-3), test::agent("box", AgentKind::box, 6, 0)}))
      << "hidden: not one bit differs";
}

TEST_F(AgentCamerasTest, SeeTheRealRobotOfTheTrainee) {
  // The robot drives around the origin; the first SLAM estimate is (1.5, 0).
  auto small = with_rovers({rover(-0.5)});
  const auto with = seen(small);
  bool seen_body = false;
  WorldSnapshot world;
  ASSERT_TRUE(state_->simulation.at(state_->simulation.now(), world));
  for (const auto& body : world.scene->bodies) seen_body = seen_body || body->owner == BodyOwner::real_robot;
  EXPECT_TRUE(seen_body);
  renderer_.reset();
  out_.clear();
  start(with_rovers({rover(-0.5)}));
  auto lost = test::drive(1);
  std::erase_if(lost, [](const Message& each) { return each.channel == channel::kPoseCov; });
  watch(lost);
  std::vector<std::uint8_t> without;
  ASSERT_TRUE(render::JpegCodec().decode(decoded<Image>(kPictures).back().bytes, without).ok());
  EXPECT_FALSE(differing(with, without).columns.empty()) << "without a pose its position is unknown";
}

TEST_F(AgentCamerasTest, AreOffAndFreeOfCostUnlessRequested) {
  start(with_rovers({rover(-3, 0)}));
  feed(test::drive(1));
  EXPECT_TRUE(state_->agent_cameras.cameras.empty());
  EXPECT_EQ(state_->tally.agent_frames_in, 0U);
  EXPECT_FALSE(out_.contains(kPictures));
}

TEST_F(AgentCamerasTest, StartAndStopByCommandOrWithTheirRobot) {
  start(with_rovers({}));
  watch(test::drive(0.1));
  AgentDefinition agent = rover(-3, 0);
  EXPECT_EQ(answer_to(AgentSpawn{.agent = agent}, 0.2).kind, EventKind::command_accepted);
  run(0.5);
  EXPECT_TRUE(out_[kPictures].empty());
  EXPECT_EQ(order_camera("rover_1", 5, 0.6).kind, EventKind::command_accepted);
  run(1.61);
  EXPECT_NEAR(static_cast<double>(out_[kPictures].size()), 6, 1);
  EXPECT_EQ(order_camera("rover_1", 0, 1.7).kind, EventKind::command_accepted);
  const std::size_t ended = out_[kPictures].size();
  run(2.5);
  EXPECT_EQ(out_[kPictures].size(), ended);
  EXPECT_EQ(order_camera("rover_1", 10, 2.6).kind, EventKind::command_accepted);
  run(3);
  const std::size_t again = out_[kPictures].size();
  EXPECT_GT(again, ended);
  EXPECT_EQ(answer_to(AgentRemove{.agent = agent.name}, 3.1).kind, EventKind::command_accepted);
  EXPECT_EQ(answer_to(AgentSpawn{.agent = agent}, 3.2).kind, EventKind::command_accepted);
  const std::size_t removed = out_[kPictures].size();
  run(4);
  EXPECT_EQ(out_[kPictures].size(), removed) << "one of that name came back without a camera";
}

TEST_F(AgentCamerasTest, MissingOrTooManyCamerasAreRefused) {
  Scenario scenario;
  scenario.max_agent_image_rate = 12;
  AgentDefinition second = rover(3, 5);
  second.name = "rover_2";
  start(with_rovers({rover(-3), second, test::agent("simple", AgentKind::robot, 0, 3)}, scenario));
  watch(test::drive(0.1));
  const auto refusal = [&](const std::string& name, double rate, double at) {
    const Event answer = order_camera(name, rate, at);
    EXPECT_EQ(answer.kind, EventKind::command_refused) << name;
    return answer.text;
  };
  EXPECT_THAT(refusal("nobody", 1, 0.20), HasSubstr("no agent is called 'nobody'"));
  EXPECT_THAT(refusal("simple", 1, 0.21), HasSubstr("give it a 'model'"));
  EXPECT_THAT(refusal("synthetic", 1, 0.22), HasSubstr("MR_CAMERA"));
  EXPECT_THAT(refusal("rover_1", -1, 0.23), HasSubstr("rate: -1, expected Hz"));
  EXPECT_THAT(refusal("rover_1", 8, 0.24), HasSubstr("at most 12 Hz"));
  EXPECT_THAT(refusal("rover_1", 20, 0.25), HasSubstr("takes 15 Hz"));
  EXPECT_EQ(order_camera("rover_1", 7, 0.26).kind, EventKind::command_accepted);
}

TEST_F(AgentCamerasTest, CamerasOfOneRateAreSpreadOverSteps) {
  std::vector<AgentDefinition> agents;
  for (int i = 0; i < 4; ++i) {
    agents.push_back(rover(-3, 2));
    agents.back().name = "rover_" + std::to_string(i + 1);
    agents.back().T_map_base = Transform<Map, Base>::planar(-3, i - 1.5, 0);
  }
  start(with_rovers(agents));
  watch(test::drive(2));
  std::set<std::int64_t> instants;
  std::size_t count = 0;
  for (const auto& [agent, stamps] : stamps_) {
    EXPECT_NEAR(static_cast<double>(stamps.size()), 4, 1) << agent;
    count += stamps.size();
    for (const SensorTime stamp : stamps) instants.insert(stamp.ns);
  }
  EXPECT_EQ(instants.size(), count);
}

TEST(AgentCameraScenario, IsRefusedAtStartWithTooManyCameras) {
  const tick::Configuration configuration = with_rovers({rover(-3, 40)}, [] {
    Scenario scenario;
    scenario.max_agent_image_rate = 60;
    return scenario;
  }());
  const auto state = tick::make_state(configuration, ArrivalTime{});
  ASSERT_FALSE(state);
  EXPECT_THAT(state.error().message, HasSubstr("scenario agent 'rover_1'"));
  EXPECT_THAT(state.error().message, HasSubstr("takes 15 Hz"));
}

TEST(AgentCameraRenderThread, DrawsTheNewestJobOfEachCameraUnderLoad) {
  const SemanticModel room = test::room();
  RenderThread renderer(room, true, 0);
  ASSERT_EQ(renderer.fault(), "");
  const auto model = test::small_camera("rover", kWidth, kHeight);
  std::set<std::uint64_t> dropped;
  std::uint64_t sequence = 0;
  std::map<std::string, std::uint64_t> newest;
  for (int i = 0; i < 20; ++i) {
    for (const char* agent : {"a", "b", "c"}) {
      tick::Outputs::Frame frame;
      frame.agent = agent;
      frame.job.camera = *model->description.camera;
      frame.sequence = newest[agent] = ++sequence;
      frame.exposure.emplace();
      if (const auto gone = renderer.submit_newest(std::move(frame))) dropped.insert(*gone);
    }
  }
  std::set<std::uint64_t> answered;
  while (const auto done = renderer.take(true)) answered.insert(done->sequence);
  for (const auto& [agent, last] : newest) EXPECT_TRUE(answered.contains(last)) << agent;
  EXPECT_EQ(answered.size() + dropped.size(), sequence);
  for (const std::uint64_t each : dropped) EXPECT_FALSE(answered.contains(each));
}

}  // namespace
}  // namespace parhelion::runtime
