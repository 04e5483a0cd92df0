// The robots that pages may drive and watch, as the world and the instructor's commands change them.
#include "server/station/robot_watch.hpp"

#include <chrono>
#include <thread>

#include "server/runtime/wall_clock.hpp"
#include "tests/server/station/teleop_fixture.hpp"

namespace parhelion::station {
namespace {

class RobotWatchTest : public TeleopServiceTest {
 protected:
  RobotWatchTest() {
    auto configuration = std::make_shared<tick::Configuration>();
    configuration->robot.name = "trainee";
    AgentDefinition rover;
    rover.name = "robot_2";
    rover.kind = AgentKind::robot;
    configuration->scenario.agents = {rover};
    VideoOptions video;
    video.robot = "trainee";
    video.now = [] { return runtime::steady_now(); };
    video.stamp = [] { return SensorTime{runtime::wall_now().ns}; };
    feed_ = std::make_unique<VideoFeed>(hub_.connect(), video);
    watch_ = std::make_unique<RobotWatch>(hub_.connect(), std::move(configuration), *feed_, service_.get());
    EXPECT_TRUE(watch_->start().ok());
  }
  void publish(const char* channel, const auto& item) {
    std::vector<std::uint8_t> payload;
    encode(item, payload);
    EXPECT_TRUE(server_->publish(channel, payload).ok());
  }
  /// Passes a world with the agent to the watch until a page gets it with `video`.
  bool reports_video(bool video) {
    WorldMessage world;
    WorldMessage::Entry body;
    body.entity = "robot_2";
    body.kind = AgentKind::robot;
    body.owner = BodyOwner::agent;
    world.bodies.push_back(body);
    const std::string wanted = std::string(R"("video":)") + (video ? "true" : "false");
    const WallTime deadline = runtime::steady_now() + seconds(20);
    while (runtime::steady_now() < deadline) {
      publish(channel::kMrWorld, world);
      auto client = open("ines", Role::observer);
      const auto words = client->texts("robots");
      const std::size_t at = words.empty() ? std::string::npos : words.back().find(R"("name":"robot_2")");
      if (at != std::string::npos) {
        const std::size_t video_at = words.back().find(R"("video":)", at);
        if (words.back().substr(video_at, wanted.size()) == wanted) return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  /// The instructor's command and the server's reply `answer`.
  void order_camera(double rate, EventKind answer) {
    const CameraRate command{.request = ++requests_, .agent = "robot_2", .rate = rate};
    publish(channel::kMrCameraRate, command);
    Event event;
    event.kind = answer;
    event.subject = "robot_2";
    event.request = command.request;
    publish(channel::kMrEvents, event);
  }

  std::unique_ptr<VideoFeed> feed_;
  std::unique_ptr<RobotWatch> watch_;
  std::uint64_t requests_ = 0;
};

TEST_F(RobotWatchTest, ReportsVideoAfterTheCameraIsRequested) {
  EXPECT_TRUE(reports_video(false));
  order_camera(5, EventKind::command_accepted);
  EXPECT_TRUE(reports_video(true));
  order_camera(0, EventKind::command_accepted);
  EXPECT_TRUE(reports_video(false));
  order_camera(50, EventKind::command_refused);
  order_camera(2, EventKind::command_accepted);
  EXPECT_TRUE(reports_video(true));
}

TEST_F(RobotWatchTest, ARobotWithoutAPoseCanBeDriven) {
  WorldMessage world;  // without bodies of the robot: nobody knows where it is
  world.robot = "trainee";
  service_->set_robots({});
  const WallTime deadline = runtime::steady_now() + seconds(20);
  bool offered = false;
  while (!offered && runtime::steady_now() < deadline) {
    publish(channel::kMrWorld, world);
    auto client = open("ines", Role::trainee);
    const auto words = client->texts("robots");
    offered = !words.empty() && words.back().find(R"("name":"trainee")") != std::string::npos;
    if (!offered) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_TRUE(offered);
}

}  // namespace
}  // namespace parhelion::station
