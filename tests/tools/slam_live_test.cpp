// SLAM and server as two processes on one LCM bus, with each engine: a robot drives through a room, and a
// virtual box stands in its scans.
#include <gtest/gtest.h>

#include <set>

#include "tests/tools/serve_fixture.hpp"

namespace parhelion::tools {
namespace {

using test::Process;

constexpr const char* kStart = "1.5,0,90deg";  ///< of test::pose_at

struct EngineCase {
  const char* engine;
  bool maps;  ///< else it localizes in a map
};

class LiveSlam : public test::ServeTest, public ::testing::WithParamInterface<EngineCase> {
 protected:
  void SetUp() override {
    ServeTest::SetUp();
    SemanticModel model = test::room();
    model.map_id.clear();  // any map: that of an engine that maps is not known yet
    std::ofstream(folder_ / "model.yaml") << to_yaml(model);
    Scenario scenario;
    scenario.name = "live";
    scenario.model = "model.yaml";
    scenario.robot = "robot.yaml";
    scenario.agents = {test::agent("box", AgentKind::box, 0.5, 2.5)};
    std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
  }

  std::vector<std::string> slam(const EngineCase& engine) {
    std::vector<std::string> arguments{"slam", "--engine", engine.engine,         "--start", kStart, "--url",
                                       url_,   "--robot",  folder_ / "robot.yaml"};
    if (engine.maps) return arguments;
    test::write_log(folder_ / "drive.lcm", test::drive(40));
    const auto mapped =
        test::run({"slam", "--log", folder_ / "drive.lcm", "--start", kStart, "--save-map", folder_ / "map"},
                  folder_ / "map.txt");
    EXPECT_EQ(mapped.exit, 0) << mapped.output;
    arguments.insert(arguments.end(), {"--map", folder_ / "map.simplemap"});
    return arguments;
  }

  /// One step of 50 ms: odometry, and a scan each second time, stamped now.
  void publish_step(int step) {
    const SensorTime now{runtime::wall_now().ns};
    const double t = 0.05 * step;
    const auto put = [&](const Message& message) {
      ASSERT_TRUE(bus_->publish(message.channel, message.payload).ok());
    };
    put(test::message(channel::kOdometry, 0, Odometry{now, test::pose_at(t).as<Odom, Base>()}));
    if (step % 2 != 0) return;
    Scan scan = test::scan_at(t);
    scan.stamp = now;
    put(test::message(channel::kScan, 0, scan));
    sent_.insert(now.utime());
  }

  /// What the server has answered.
  void receive_until(WallTime deadline) {
    Message message;
    while (runtime::steady_now() < deadline) {
      const auto received = bus_->receive(message, deadline - runtime::steady_now());
      if (!received.ok() || !*received) return;
      Scan scan;
      ScanInfo info;
      if (message.channel == channel::kMrScan && decode(message.channel, message.payload, scan).ok())
        answered_.insert(scan.stamp.utime());
      if (message.channel == channel::kMrScanInfo && decode(message.channel, message.payload, info).ok()) {
        injected_ += std::count_if(info.beam_agent.begin(), info.beam_agent.end(),
                                   [](std::int16_t agent) { return agent >= 0; }) > 0;
        reason_ = info.reason;
      }
    }
  }

  std::set<std::int64_t> sent_, answered_;  ///< utime
  int injected_ = 0;                        ///< scans in which the box is seen
  std::string reason_;                      ///< of the last scan that was passed on unchanged
};

TEST_P(LiveSlam, PosesOfEachEnginePutTheBoxIntoTheScans) {
  constexpr int enough = 20, longest = 30 * 20;  // scans, steps
  Process server(serve("live.lcm"), folder_ / "serve.txt");
  ASSERT_TRUE(await_server(server, 1));
  Process slam_process(slam(GetParam()), folder_ / "slam.txt");
  WallTime next = runtime::steady_now();
  for (int step = 0; step < longest && injected_ < enough; ++step) {
    publish_step(step);
    next = next + milliseconds(50);
    receive_until(next);
  }
  receive_until(runtime::steady_now() + milliseconds(300));
  EXPECT_GE(injected_, enough) << reason_ << "\n"
                               << test::bytes_of(folder_ / "slam.txt")
                               << test::bytes_of(folder_ / "serve.txt");
  EXPECT_EQ(answered_, sent_);
}

INSTANTIATE_TEST_SUITE_P(Engines, LiveSlam,
                         ::testing::Values(EngineCase{"parhelion", true}, EngineCase{"parhelion", false},
                                           EngineCase{"mrpt-icp", true}, EngineCase{"mrpt-rbpf", true},
                                           EngineCase{"mrpt-localization", false}),
                         [](const auto& param) {
                           std::string name = param.param.engine;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name + (param.param.maps ? "_maps" : "_localizes");
                         });

}  // namespace
}  // namespace parhelion::tools
