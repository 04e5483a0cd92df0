// A live server with keys, its robot and trainee, and a stranger on the same bus who has none.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "protocols/authentication/signed_bus.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tests/long_run.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

class AuthenticationTest : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "model.yaml") << to_yaml(test::room());
    std::ofstream(folder_ / "robot.yaml") << to_yaml(test::robot());
    Scenario scenario;
    scenario.name = "strangers";
    scenario.model = "model.yaml";
    scenario.robot = "robot.yaml";
    scenario.authentication = true;
    std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
    make_key("ann", {"--role", "trainee"});
    make_key("rover", {"--role", "robot", "--role", "localization"});
    stranger_ = open(nullptr);
    ASSERT_TRUE(stranger_);
    ASSERT_TRUE(stranger_->subscribe(".*", 4000));
  }

  void make_key(const std::string& name, std::vector<std::string> more) {
    std::vector<std::string> arguments{
        "key", "new", name, "--server", folder_ / "server.keys", "-o", folder_ / (name + ".keys")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto made = test::run(arguments, folder_ / "key.txt");
    ASSERT_EQ(made.exit, 0) << made.output;
  }
  /// `name`: of the sender; nullptr: without keys.
  std::unique_ptr<Bus> open(const char* name) {
    auto bus = open_network_bus(test::bus_url());
    EXPECT_TRUE(bus) << bus.error().message;
    if (!bus || name == nullptr) return bus ? std::move(*bus) : nullptr;
    const auto keys = load_keys(folder_ / (std::string(name) + ".keys"));
    EXPECT_TRUE(keys) << keys.error().message;
    return sign(std::move(*bus), *keys, {});
  }
  std::vector<std::string> serve() {
    return {"serve",
            folder_ / "scenario.yaml",
            "-o",
            folder_ / "session.lcm",
            "--url",
            test::bus_url(),
            "--no-restart",
            "--state-folder",
            folder_ / "state",
            "--keys",
            folder_ / "server.keys"};
  }
  static void send(Bus& bus, const Message& message) {
    EXPECT_TRUE(bus.publish(message.channel, message.payload));
  }
  static Message teleop(double speed) {
    return test::message(channel::kTeleop, 0, TwistCommand{{runtime::wall_now().ns}, {speed, 0, 0}});
  }
  /// Takes what the stranger hears within `time`: the newest MR_CMD's speed, recorded messages, events.
  void listen(Duration time) {
    const WallTime deadline = runtime::steady_now() + time;
    Message message;
    while (runtime::steady_now() < deadline) {
      const auto came = stranger_->receive(message, deadline - runtime::steady_now());
      if (!came || !*came) return;
      TwistCommand command;
      Event event;
      if (message.channel == channel::kMrCmd && decode(message.channel, message.payload, command)) {
        commanded_ = command.twist.vx;
        moved_ = moved_ || command.twist.vx != 0;
      } else if (message.channel == channel::kMrEvents && decode(message.channel, message.payload, event)) {
        ++events_[event.kind];
        if (event.kind == EventKind::foreign_publisher) ++refusals_[event.text];
      } else if (message.channel == channel::kTeleop) {
        recorded_.push_back(message);
      }
    }
  }
  /// The server has no pose: after the stick was let go, the robot may crawl.
  bool drives(Bus& trainee) {
    commanded_.reset();
    for (int tries = 0; tries < 200 && !commanded_; ++tries) {
      send(trainee, teleop(0));
      listen(milliseconds(20));
    }
    for (int tries = 0; tries < 200; ++tries) {
      send(trainee, teleop(0.3));
      listen(milliseconds(20));
      if (commanded_ && *commanded_ > 0) return true;
    }
    return false;
  }

  test::TemporaryFolder folder_;
  std::unique_ptr<Bus> stranger_;
  std::optional<double> commanded_;
  bool moved_ = false;
  std::map<EventKind, int> events_;
  std::map<std::string, int> refusals_;
  std::vector<Message> recorded_;
};

TEST_F(AuthenticationTest, WithoutKeysAServerWhoseScenarioAsksForThemDoesNotStart) {
  auto arguments = serve();
  arguments.resize(arguments.size() - 2);
  const auto ran = test::run(arguments, folder_ / "serve.txt");
  EXPECT_EQ(ran.exit, 1);
  EXPECT_NE(ran.output.find("--keys FILE"), std::string::npos) << ran.output;
}

// 20,000 messages in each run, 100,000 in the long one.
TEST_F(AuthenticationTest, AStrangerMovesNothingAndIsNamedOnce) {
  test::Process server(serve(), folder_ / "serve.txt");
  const auto ann = open("ann"), rover = open("rover");
  ASSERT_TRUE(drives(*ann)) << test::bytes_of(folder_ / "serve.txt");
  ASSERT_FALSE(recorded_.empty());
  send(*rover, test::message(channel::kScan, 0, test::scan_at(1)));
  const EmergencyStopCommand stop{.request = 1, .robot = test::robot().name, .engaged = true};
  const Message stopped = test::message(channel::kMrEmergencyStop, 0, stop);
  for (int tries = 0; tries < 100 && events_[EventKind::command_accepted] == 0; ++tries) {
    send(*ann, stopped);
    listen(milliseconds(50));
  }
  ASSERT_GT(events_[EventKind::command_accepted], 0);
  listen(milliseconds(700));
  events_.clear();
  moved_ = false;

  EmergencyStopCommand release = stop;
  release.engaged = false;
  release.request = 2;
  AgentSpawn box{.stamp = {runtime::wall_now().ns}, .request = 3};
  box.agent = test::agent("box", AgentKind::box, 2, 0);
  std::vector<Message> attacks{test::message(channel::kMrEmergencyStop, 0, release),
                               test::message(channel::kMrSpawn, 0, box),
                               test::message(channel::kScan, 0, test::scan_at(1)),
                               test::message(channel::kMrScan, 0, test::scan_at(1)),
                               test::message(channel::kPoseCov, 0, PoseEstimate{}),
                               test::message(channel::kJointCmd, 0, Joints{{}, {"arm"}, {1}, {}, {}}),
                               {channel::kMrFault, {}, std::vector<std::uint8_t>(500, 255)}};
  const int messages = test::long_run() ? 100'000 : 20'000;
  for (int i = 0; i < messages; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (i % 3 == 0) {
      send(*stranger_, teleop(0.4));
    } else if (i % 3 == 1) {
      send(*stranger_, recorded_[at % recorded_.size()]);
    } else {
      send(*stranger_, attacks[at % attacks.size()]);
    }
    // The kernel's buffer: what is lost attacks nobody.
    if (i % 50 == 0) listen(milliseconds(1));
  }
  listen(milliseconds(1500));
  EXPECT_FALSE(moved_);
  EXPECT_EQ(events_[EventKind::command_accepted], 0);
  EXPECT_EQ(events_[EventKind::command_refused], 0);
  for (const auto& [text, count] : refusals_) EXPECT_EQ(count, 1) << text;
  EXPECT_TRUE(refusals_.contains("a message on TELEOP was not signed: refused, and counted from now on"));
  EXPECT_TRUE(
      refusals_.contains("a message on TELEOP was received before, or overtaken by a newer one: refused, and "
                         "counted from now on") ||
      refusals_.contains("a message on TELEOP was signed too long ago, or with another clock: refused, and "
                         "counted from now on"));
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0) << test::bytes_of(folder_ / "serve.txt");
  const auto replayed = test::run({"replay", folder_ / "session.lcm", "--report", folder_ / "report.json"},
                                  folder_ / "replay.txt");
  EXPECT_EQ(replayed.exit, 0) << replayed.output;
}

TEST_F(AuthenticationTest, TheTraineeMayNotSendWhatTheRobotSends) {
  test::Process server(serve(), folder_ / "serve.txt");
  const auto ann = open("ann");
  ASSERT_TRUE(drives(*ann)) << test::bytes_of(folder_ / "serve.txt");
  for (int tries = 0; tries < 100 && refusals_.empty(); ++tries) {
    send(*ann, test::message(channel::kScan, 0, test::scan_at(1)));
    listen(milliseconds(50));
  }
  ASSERT_EQ(refusals_.size(), 1U);
  EXPECT_NE(refusals_.begin()->first.find("a sender that may not publish there"), std::string::npos);
}

TEST_F(AuthenticationTest, TheRelayPassesOnWhatTheServerSignedAndNothingElse) {
  test::Process server(serve(), folder_ / "serve.txt");
  const std::string robot_url = test::bus_url(68);
  test::Process relay(
      {"relay", "--keys", folder_ / "rover.keys", "--url", test::bus_url(), "--robot-url", robot_url},
      folder_ / "relay.txt");
  auto motor = open_network_bus(robot_url);
  ASSERT_TRUE(motor) << motor.error().message;
  ASSERT_TRUE((*motor)->subscribe("MR_CMD", 100));
  const auto ann = open("ann");
  Message message;
  TwistCommand command;
  double driven = 0;
  // The server obeys a stick that it has seen let go: first zeros, until it answers.
  for (int tries = 0, answers = 0; tries < 400 && driven == 0; ++tries) {
    send(*ann, teleop(answers == 0 ? 0 : 0.3));
    const Message forged =
        test::message(channel::kMrCmd, 0, TwistCommand{{runtime::wall_now().ns}, {9, 0, 0}});
    send(*stranger_, forged);
    while (*(*motor)->receive(message, milliseconds(20))) {
      ASSERT_TRUE(decode(message.channel, message.payload, command));
      ++answers;
      ASSERT_LE(command.twist.vx, 0.31) << "forged";
      driven = std::max(driven, command.twist.vx);
    }
  }
  EXPECT_GT(driven, 0) << test::bytes_of(folder_ / "relay.txt") << test::bytes_of(folder_ / "serve.txt");
  // Both ends of the server's death: the relay stops the robot.
  server.signal(SIGKILL);
  const WallTime killed = runtime::steady_now();
  while (command.twist.vx != 0 && runtime::steady_now() - killed < seconds(5.0)) {
    if (*(*motor)->receive(message, milliseconds(50))) {
      ASSERT_TRUE(decode(message.channel, message.payload, command));
    }
  }
  EXPECT_EQ(command.twist.vx, 0);
  relay.signal(SIGTERM);
  EXPECT_EQ(relay.wait(), 0) << test::bytes_of(folder_ / "relay.txt");
}

}  // namespace
}  // namespace parhelion::tools
