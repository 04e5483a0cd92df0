// Shipped level 1 scenarios in normal use: `serve` as a process, driven over LCM.
#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "server/runtime/wall_clock.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

using testing::HasSubstr;

class Level1Test : public testing::Test {
 protected:
  void SetUp() override {
    auto bus = open_network_bus(test::bus_url(68));
    ASSERT_TRUE(bus.ok()) << bus.error().message;
    bus_ = std::move(*bus);
    for (const char* name : {channel::kScan, channel::kOdometry, channel::kMrScan, channel::kMrEvents})
      ASSERT_TRUE(bus_->subscribe(name, 2000).ok());
  }

  /// Sends TELEOP twenty times a second until `done`, for a minute at most.
  bool drive(test::Process& server, const Twist2& twist, const std::function<bool()>& done) {
    const WallTime deadline = runtime::steady_now() + seconds(60);
    WallTime last_sent;
    while (!done() && server.running() && runtime::steady_now() < deadline) {
      if (runtime::steady_now() - last_sent >= milliseconds(50)) {
        last_sent = runtime::steady_now();
        const Message command =
            test::message(channel::kTeleop, 0, TwistCommand{{runtime::wall_now().ns}, twist});
        EXPECT_TRUE(bus_->publish(command.channel, command.payload).ok());
      }
      receive_message();
    }
    return done();
  }
  void receive_message() {
    Message message;
    const auto received = bus_->receive(message, milliseconds(20));
    if (!received.ok() || !*received) return;
    ++count_[message.channel];
    Event event;
    if (message.channel == channel::kMrEvents && decode(message.channel, message.payload, event).ok())
      events_.push_back(event);
  }
  /// To `who`: the event's subject or object.
  bool happened(EventKind kind, const std::string& who = "trainee") const {
    return std::any_of(events_.begin(), events_.end(), [&](const Event& event) {
      return event.kind == kind && (event.subject == who || event.object == who);
    });
  }

  test::TemporaryFolder folder_;
  std::unique_ptr<Bus> bus_;
  std::map<std::string, int> count_;
  std::vector<Event> events_;
};

nlohmann::json report_of(const std::string& path) { return nlohmann::json::parse(test::bytes_of(path)); }

TEST_F(Level1Test, TheShippedScenarioReplaysToTheSameBytes) {
  const std::string scenario = std::string(PARHELION_SOURCE_DIR) + "/server/scenarios/workshop.yaml";
  const auto valid = test::run({"validate", scenario}, folder_ / "validate.txt");
  EXPECT_EQ(valid.exit, 0) << valid.output;
  test::Process server({"serve", scenario, "-o", folder_ / "session.lcm", "--report", folder_ / "live.json",
                        "--url", test::bus_url(68), "--no-restart"},
                       folder_ / "serve.txt");
  const auto server_output = [this] { return test::bytes_of(folder_ / "serve.txt"); };
  ASSERT_TRUE(drive(server, {}, [this] {
    return count_[channel::kScan] > 10 && count_[channel::kOdometry] > 10 && count_[channel::kMrScan] > 10;
  })) << server_output();
  EXPECT_TRUE(drive(server, {0.5, 0, 0}, [this] { return happened(EventKind::movement_started); }))
      << server_output();
  EXPECT_TRUE(drive(server, {0.5, 0, 0}, [this] { return happened(EventKind::contact_started, "door 1"); }))
      << server_output();
  EXPECT_TRUE(drive(server, {0.5, 0, 0}, [this] { return happened(EventKind::door_opened, "door 1"); }))
      << server_output();
  EXPECT_TRUE(drive(server, {0.5, 0, 0}, [this] { return happened(EventKind::zone_entered, "second room"); }))
      << server_output();

  // A second sender on the robot's channels is reported and ignored.
  const Message foreign = test::message(channel::kOdometry, 0, Odometry{{runtime::wall_now().ns}, {}});
  ASSERT_TRUE(bus_->publish(foreign.channel, foreign.payload).ok());
  EXPECT_TRUE(drive(server, {}, [this] {
    return happened(EventKind::foreign_publisher, channel::kOdometry);
  })) << server_output();
  EXPECT_TRUE(drive(server, {}, [this] { return happened(EventKind::movement_stopped); })) << server_output();
  const auto reset =
      test::run({"inject", "reset", "--name", "trainee", "--url", test::bus_url(68)}, folder_ / "reset.txt");
  EXPECT_EQ(reset.exit, 0) << reset.output;
  EXPECT_TRUE(drive(server, {}, [this] { return happened(EventKind::agent_moved); })) << server_output();
  server.signal(SIGINT);
  EXPECT_EQ(server.wait(), 0) << server_output();

  const auto replayed = test::run(
      {"replay", folder_ / "session.lcm", "-o", folder_ / "again.lcm", "--report", folder_ / "again.json"},
      folder_ / "replay.txt");
  ASSERT_EQ(replayed.exit, 0) << replayed.output;
  EXPECT_EQ(report_of(folder_ / "again.json")["hash"], report_of(folder_ / "live.json")["hash"]);
}

/// Real time, about 15 s: forward through the door, back through it, and stop.
TEST_F(Level1Test, DrivingAShippedProgrammeRaisesAndExplainsTheScore) {
  const std::string scenario =
      std::string(PARHELION_SOURCE_DIR) + "/server/scenarios/programmes/doorway.yaml";
  const std::string log = folder_ / "session.lcm";
  test::Process server({"serve", scenario, "-o", log, "--url", test::bus_url(68), "--no-restart"},
                       folder_ / "serve.txt");
  const auto server_output = [this] { return test::bytes_of(folder_ / "serve.txt"); };
  const auto scores = [this] {
    std::vector<double> all;
    for (const Event& event : events_) {
      if (event.kind == EventKind::score_changed) all.push_back(event.value);
    }
    return all;
  };
  const auto at_the_start = [this] {
    const auto last = std::find_if(events_.rbegin(), events_.rend(),
                                   [](const Event& event) { return event.object == "start"; });
    return last != events_.rend() && last->kind == EventKind::zone_entered;
  };
  ASSERT_TRUE(drive(server, {}, [this] { return count_[channel::kMrScan] > 10; })) << server_output();
  EXPECT_THAT(server_output(), HasSubstr("through the door: 40 points, required")) << "the briefing";
  EXPECT_TRUE(drive(server, {0.7, 0, 0}, [&] { return scores().size() == 1; })) << server_output();
  EXPECT_TRUE(drive(server, {-0.7, 0, 0}, [&] { return scores().size() == 2; })) << server_output();
  EXPECT_TRUE(drive(server, {-0.7, 0, 0}, at_the_start)) << server_output();
  EXPECT_TRUE(drive(server, {}, [this] { return happened(EventKind::grading_ended); })) << server_output();
  EXPECT_EQ(scores(), (std::vector<double>{40, 80, 100}));
  server.signal(SIGINT);
  EXPECT_EQ(server.wait(), 0) << server_output();

  const auto graded = test::run({"grade", log}, folder_ / "grade.txt");
  EXPECT_EQ(graded.exit, 0) << graded.output;
  EXPECT_THAT(graded.output, HasSubstr("100 of 100 points (100.0 %), grade excellent, passed"));
  const auto reported = test::run({"report", log, "-o", folder_ / "report.html"}, folder_ / "report.txt");
  EXPECT_EQ(reported.exit, 0) << reported.output;
  EXPECT_THAT(test::bytes_of(folder_ / "report.html"), HasSubstr("stop at the start"));
}

}  // namespace
}  // namespace parhelion::tools
