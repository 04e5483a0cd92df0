// A live server with mapping: the model grows, scans continue, and the session replays to the same bytes.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "server/runtime/loop.hpp"
#include "server/runtime/replay.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tests/server/tick/same_bytes.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::runtime {
namespace {

tick::Configuration mapping_configuration() {
  tick::Configuration configuration =
      test::configuration({test::agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander)});
  configuration.scenario.mapping = true;
  DepthCameraDescription depth;
  depth.intrinsics.width = 4;
  depth.intrinsics.height = 2;
  depth.intrinsics.fx = depth.intrinsics.fy = 3;
  configuration.robot.depth = depth;
  configuration.robot.line_laser = {*configuration.robot.laser, {}};
  return configuration;
}

Image depth_image(std::int64_t utime) {
  Image image;
  image.stamp = SensorTime::from_utime(utime);
  image.width = 4;
  image.height = 2;
  image.row_stride = 8;
  image.format = PixelFormat::depth_mm;
  image.bytes.assign(16, 1);
  image.metadata.push_back({"encoding", {'r', 'a', 'w'}});
  return image;
}

/// The synthetic drive with a depth image after each fourth scan and a line after each.
std::vector<Message> drive_with_depth(double duration) {
  std::vector<Message> images;
  for (double t = 0.05; t < duration; t += 0.1) {
    const auto utime = test::kStartUs + static_cast<std::int64_t>(t * 1e6);
    images.push_back(test::message(channel::kLines, utime + 10'000, test::scan_at(t)));
  }
  for (double t = 0.4; t < duration; t += 0.4) {
    const auto utime = test::kStartUs + static_cast<std::int64_t>(t * 1e6);
    images.push_back(test::message(channel::kDepth, utime + 40'000, depth_image(utime)));
  }
  return test::drive(duration, std::move(images));
}

TEST(MappingLoop, TheModelGrowsDuringASessionThatReplaysIdentically) {
  const test::TemporaryFolder folder;
  MemoryBusHub hub;
  const auto server_bus = hub.connect(), robot = hub.connect();
  ASSERT_TRUE(robot->subscribe("MR_(SCAN|EVENTS)", 10'000).ok());
  const tick::Configuration configuration = mapping_configuration();
  std::atomic<bool> stop = false, started = false;
  std::atomic<int> updates = 0;
  ServeOptions options;
  options.session = folder / "session.lcm";
  options.guard = seconds(10);
  options.stop = [&] { return stop.load(); };
  options.notify = [&](const std::string&) { started = true; };
  options.update_site = [&](const SiteView& view) -> Result<std::optional<SemanticModel>> {
    EXPECT_EQ(std::get<PlacedDepth>(view).depth.width, 4);
    SemanticModel model = test::room();
    model.entities[3] = test::wall("wall 4", 5 - 0.01 * ++updates, 0, std::numbers::pi / 2, 7.8);
    return std::optional(model);
  };
  std::optional<Result<Report>> report;
  std::thread server([&] { report.emplace(serve(*server_bus, configuration, options)); });
  while (!started) std::this_thread::yield();
  const auto log = drive_with_depth(3);
  const WallTime begun = steady_now();
  for (const Message& each : log) {
    while (steady_now() - begun < each.arrival - log.front().arrival)
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    EXPECT_TRUE(robot->publish(each.channel, each.payload).ok());
  }
  std::size_t answered = 0;
  bool changed = false;
  Message message;
  while (answered < 30 || !changed) {
    const auto received = robot->receive(message, seconds(20));
    if (!received.ok() || !*received) break;
    Event event;
    if (message.channel == channel::kMrScan)
      ++answered;
    else if (decode(message.channel, message.payload, event))
      changed |= event.kind == EventKind::model_changed;
  }
  EXPECT_EQ(answered, 30U);
  stop = true;
  server.join();
  ASSERT_TRUE(report->ok()) << report->error().message;
  const Report& live = **report;
  const auto changes = live.tally.events[static_cast<std::size_t>(EventKind::model_changed)];
  EXPECT_GT(changes, 0U);
  EXPECT_EQ(live.tally.refused_inputs, 0U) << live.tally.last_refusal;
  EXPECT_NE(live.notes.at("mapping").find(" models"), std::string::npos);

  ReplayOptions again;
  again.log = folder / "session.lcm";
  again.session = folder / "again.lcm";
  const auto replayed = replay(again);
  ASSERT_TRUE(replayed.ok()) << replayed.error().message;
  EXPECT_EQ(replayed->tally.events[static_cast<std::size_t>(EventKind::model_changed)], changes);
  EXPECT_EQ(replayed->hash, live.hash) << test::difference(again.log, again.session);
}

}  // namespace
}  // namespace parhelion::runtime
