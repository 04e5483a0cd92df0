// Promise 6 and the live server over real LCM: at whatever moment it is killed, everything that it
// acknowledged is in its log.
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <random>
#include <set>
#include <thread>

#include "server/station/http/accounts.hpp"
#include "server/station/http/password.hpp"
#include "tests/long_run.hpp"
#include "tests/server/station/http/raw_client.hpp"
#include "tests/tools/serve_fixture.hpp"

namespace parhelion::tools {
namespace {

using test::ServeTest;

TEST_F(ServeTest, ServeLosesNoAcknowledgedDataWhenKilled) {
  const int kills = test::long_run() ? 1000 : 50;
  std::mt19937 random(3);
  std::uint64_t request = 1;
  for (int round = 0; round < kills; ++round) {
    test::Process server(serve("session.lcm"), folder_ / "serve.txt");
    std::set<std::uint64_t> acknowledged;
    ASSERT_TRUE(await_server(server, request));
    acknowledged.insert(request++);
    const int commands = 1 + static_cast<int>(random() % 20);
    for (int i = 0; i < commands; ++i) {
      const Message command = spawn(request++, i + 1);
      ASSERT_TRUE(bus_->publish(command.channel, command.payload).ok());
      if (random() % 2 == 0) {
        if (const std::uint64_t answered = answer(seconds(2)); answered != 0) acknowledged.insert(answered);
      }
    }
    server.signal(SIGKILL);
    EXPECT_EQ(server.wait(), 128 + SIGKILL);
    while (const std::uint64_t answered = answer(milliseconds(2))) acknowledged.insert(answered);
    const auto kept = commands_in("session.lcm");
    for (const std::uint64_t each : acknowledged) ASSERT_TRUE(kept.contains(each)) << "round " << round;
  }
}

TEST_F(ServeTest, ServeRestartsWithinASecondAfterACrash) {
  auto arguments = serve("session.lcm");
  std::erase(arguments, "--no-restart");
  test::Process server(arguments, folder_ / "serve.txt");
  ASSERT_TRUE(await_server(server, 1));
  const WallTime deadline = runtime::steady_now() + seconds(20);
  const pid_t child = child_of(server);
  ASSERT_NE(child, 0);
  kill(child, SIGKILL);
  bool answered = false;
  while (!answered && runtime::steady_now() < deadline) {
    const pid_t now = child_of(server);
    const bool again = now != 0 && now != child;
    const Message scan = test::message(channel::kScan, 0, test::scan_at(again ? 2 : 1));
    ASSERT_TRUE(bus_->publish(scan.channel, scan.payload).ok());
    Message message;
    const auto received = bus_->receive(message, milliseconds(50));
    ASSERT_TRUE(received.ok());
    // A message of the killed server may still arrive: the scan that it had processed.
    answered = again && *received && message.channel == channel::kMrScan && message.payload == scan.payload;
  }
  EXPECT_TRUE(answered);
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0);
  // The log of the killed server stays; the new one is beside it and is a separate session.
  EXPECT_TRUE(commands_in("session.lcm").contains(1));
  std::vector<std::string> later;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "")) {
    const std::string name = entry.path().filename();
    if (name.starts_with("session-") && name.ends_with(".lcm")) later.push_back(name);
  }
  ASSERT_EQ(later.size(), 1U);
  const auto replayed =
      test::run({"replay", folder_ / later[0], "--report", folder_ / "report.json"}, folder_ / "replay.txt");
  EXPECT_EQ(replayed.exit, 0) << replayed.output;
}

// Twenty in each run, two hundred in the long one.
TEST_F(ServeTest, ServeComesBackAfterEachDeathAndKeepsTheRobotStopped) {
  const int deaths = test::long_run() ? 200 : 20;
  auto arguments = serve("session.lcm");
  std::erase(arguments, "--no-restart");
  test::Process server(arguments, folder_ / "serve.txt");
  ASSERT_TRUE(await_server(server, 1));
  ASSERT_TRUE(emergency_stop(true, 2));
  pid_t before = 0;
  for (int death = 0; death < deaths; ++death) {
    const pid_t child = child_of(server);
    ASSERT_NE(child, 0) << death;
    ASSERT_NE(child, before);
    before = child;
    kill(child, death % 2 == 0 ? SIGKILL : SIGSEGV);
    ASSERT_TRUE(await_server(server, static_cast<std::uint64_t>(100 + death))) << "death " << death;
  }
  EXPECT_EQ(why_reduced(), "emergency_stop");
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0) << test::bytes_of(folder_ / "serve.txt");
  for (int number = 2; number < deaths + 2; ++number)
    EXPECT_TRUE(std::filesystem::exists(folder_ / ("session-" + std::to_string(number) + ".lcm"))) << number;
}

// The robot must stop at once: nobody looks for a password first.
TEST_F(ServeTest, AnInstructorStopsTheRobotAfterACrashWithoutLoggingInAgain) {
  const std::filesystem::path state = folder_ / "state";
  std::filesystem::create_directory(state);
  auto accounts = station::Accounts::open(state / "accounts.json");
  const auto hash = station::hash_password("correct horse");
  ASSERT_TRUE(accounts && hash);
  ASSERT_TRUE((*accounts)->put_first("root", *hash));
  const std::uint16_t port = test::free_port();
  auto arguments = serve("session.lcm");
  std::erase(arguments, "--no-restart");
  arguments.insert(arguments.end(), {"--http", "127.0.0.1:" + std::to_string(port)});
  test::Process server(arguments, folder_ / "serve.txt");
  ASSERT_TRUE(await_server(server, 1));
  const test::RawAnswer entered =
      test::RawClient(port).post("/api/v1/login", R"({"name":"root","password":"correct horse"})");
  ASSERT_EQ(entered.status, 204) << entered.body;
  const std::string set = entered.headers.at("set-cookie"), cookie = set.substr(0, set.find(';'));
  const pid_t child = child_of(server);
  kill(child, SIGKILL);
  ASSERT_TRUE(await_server(server, 2));
  ASSERT_NE(child_of(server), child);
  test::RawClient page(port);
  ASSERT_EQ(page.open_socket("/ws/state", cookie).status, 101) << test::bytes_of(folder_ / "serve.txt");
  ASSERT_TRUE(page.send_text(R"({"type":"estop","request":7})"));
  bool stopped = false;
  while (const auto frame = page.frame()) {
    if (frame->opcode == 8) break;
    if (frame->payload.find(R"("type":"reply")") == std::string::npos) continue;
    stopped = frame->payload.find(R"("ok":true)") != std::string::npos;
    EXPECT_TRUE(stopped) << frame->payload;
    break;
  }
  EXPECT_TRUE(stopped);
  EXPECT_EQ(why_reduced(), "emergency_stop");
}

/// How a server ends while its robot drives.
enum class ServerEnd { asked, killed, supervisor_killed };

class ServeEndTest : public ServeTest {
 protected:
  void expect_stop_after(ServerEnd end);
  /// Newest MR_CMD of those that arrive within `time`. moved_: whether any of them moves the robot.
  std::optional<Twist2> newest_command(Duration time) {
    std::optional<Twist2> newest;
    moved_ = false;
    const WallTime deadline = runtime::steady_now() + time;
    Message message;
    TwistCommand command;
    while (runtime::steady_now() < deadline) {
      const auto came = bus_->receive(message, deadline - runtime::steady_now());
      if (!came || !*came) break;
      Event event;
      if (message.channel == channel::kMrCmd && decode(message.channel, message.payload, command).ok())
        newest = command.twist;
      if (message.channel == channel::kMrEvents && decode(message.channel, message.payload, event).ok())
        events_ += std::string("\n") + to_string(event.kind) + " " + event.subject + " " + event.text;
      moved_ = moved_ || (newest && newest->vx != 0);
    }
    return newest;
  }
  /// Drives until MR_CMD does. The server has no pose: after the stick was let go, the robot may crawl.
  ::testing::AssertionResult drives() {
    events_.clear();
    std::optional<Twist2> released;
    for (int tries = 0; tries < 100 && !released; ++tries) {
      teleop(0);
      released = newest_command(milliseconds(20));
    }
    for (int tries = 0; tries < 100; ++tries) {
      teleop(0.3);
      const auto command = newest_command(milliseconds(20));
      if (command && command->vx > 0) return ::testing::AssertionSuccess();
    }
    return ::testing::AssertionFailure()
           << (released ? "MR_CMD stays zero; events:" : "no MR_CMD; events:") << events_;
  }
  void teleop(double speed) {
    const Message drive =
        test::message(channel::kTeleop, 0, TwistCommand{{runtime::wall_now().ns}, {speed, 0, 0}});
    ASSERT_TRUE(bus_->publish(drive.channel, drive.payload).ok());
  }

  bool moved_ = false;
  std::string events_;  ///< that arrived since the robot was to drive
};

void ServeEndTest::expect_stop_after(ServerEnd end) {
  auto arguments = serve("session.lcm");
  std::erase(arguments, "--no-restart");
  test::Process server(arguments, folder_ / "serve.txt");
  ASSERT_TRUE(await_server(server, 1));
  const pid_t child = child_of(server);
  ASSERT_TRUE(drives());
  teleop(0.3);
  switch (end) {
    case ServerEnd::asked:
      server.signal(SIGTERM);
      EXPECT_EQ(server.wait(), 0);
      break;
    case ServerEnd::killed:
      kill(child, SIGKILL);
      break;
    case ServerEnd::supervisor_killed:
      server.signal(SIGKILL);
      server.wait();
      break;
  }
  const auto last = newest_command(milliseconds(400));
  ASSERT_TRUE(last) << "no command at all";
  EXPECT_EQ(last->vx, 0);
}

TEST_F(ServeEndTest, TheLastCommandIsAStopWhenItIsAskedToEnd) { expect_stop_after(ServerEnd::asked); }

TEST_F(ServeEndTest, TheLastCommandIsAStopWhenTheServerIsKilled) { expect_stop_after(ServerEnd::killed); }

TEST_F(ServeEndTest, TheLastCommandIsAStopWhenTheSupervisorIsKilled) {
  expect_stop_after(ServerEnd::supervisor_killed);
}

TEST_F(ServeEndTest, ACommandFromBeforeAPauseOfTheServerIsRefused) {
  const int pauses = test::long_run() ? 1000 : 5;
  test::Process server(serve("session.lcm"), folder_ / "serve.txt");
  ASSERT_TRUE(await_server(server, 1));
  std::mt19937 random(5);
  for (int pause = 0; pause < pauses; ++pause) {
    ASSERT_TRUE(drives()) << test::bytes_of(folder_ / "serve.txt");
    server.signal(SIGSTOP);
    newest_command(milliseconds(100));  // all that was sent before
    teleop(0.3);
    std::this_thread::sleep_for(std::chrono::milliseconds(300 + random() % 500));
    server.signal(SIGCONT);
    const auto command = newest_command(milliseconds(200));
    EXPECT_TRUE(!command || command->vx == 0) << "pause " << pause;
    EXPECT_FALSE(moved_) << "pause " << pause;
  }
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0);
}

TEST_F(ServeTest, AMalformedRobotIsRefusedAndTheNextOneIsServed) {
  Scenario scenario;
  scenario.name = "waits";
  scenario.model = "model.yaml";
  std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
  test::Process server(serve("session.lcm"), folder_ / "serve.txt");
  const Message bad = test::message(channel::kRobot, 0, RobotMessage{{}, "name: [rover"});
  const auto waited_for = [&](const std::string& text, const Message& sent) {
    for (int tries = 0; tries < 200; ++tries) {
      EXPECT_TRUE(bus_->publish(sent.channel, sent.payload).ok());
      if (test::bytes_of(folder_ / "serve.txt").find(text) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return false;
  };
  ASSERT_TRUE(waited_for("still waiting", bad)) << test::bytes_of(folder_ / "serve.txt");
  const Message good = test::message(channel::kRobot, 0, RobotMessage{{}, to_yaml(test::robot())});
  ASSERT_TRUE(waited_for("serving", good)) << test::bytes_of(folder_ / "serve.txt");
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0);
}

TEST_F(ServeTest, ServeKeepsAStoppedRobotStoppedAfterACrash) {
  auto arguments = serve("session.lcm");
  std::erase(arguments, "--no-restart");
  test::Process server(arguments, folder_ / "serve.txt");
  ASSERT_TRUE(await_server(server, 1));
  ASSERT_TRUE(emergency_stop(true, 2));
  const pid_t child = child_of(server);
  kill(child, SIGKILL);
  ASSERT_TRUE(await_server(server, 3));
  EXPECT_NE(child_of(server), child);
  EXPECT_NE(test::bytes_of(folder_ / "serve.txt").find("still is"), std::string::npos);
  EXPECT_EQ(why_reduced(), "emergency_stop");
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0) << test::bytes_of(folder_ / "serve.txt");
}

TEST_F(ServeTest, ASessionWhoseLogWasDeletedFails) {
  auto arguments = serve("session.lcm");
  std::erase(arguments, "--no-restart");
  test::Process server(arguments, folder_ / "serve.txt");
  ASSERT_TRUE(await_server(server, 1));
  std::filesystem::remove(folder_ / "session.lcm");
  ASSERT_TRUE(await_server(server, 2)) << "it goes on serving, and answers";
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 1);
  const std::string output = test::bytes_of(folder_ / "serve.txt");
  EXPECT_NE(output.find("session.lcm: deleted or moved during the session"), std::string::npos) << output;
  EXPECT_NE(output.find("INCOMPLETE"), std::string::npos) << output;
}

TEST_F(ServeTest, AnEmergencyStopPersistsAcrossServersUntilReset) {
  {
    test::Process server(serve("first.lcm"), folder_ / "serve.txt");
    ASSERT_TRUE(await_server(server, 1));
    ASSERT_TRUE(emergency_stop(true, 2));
    server.signal(SIGKILL);
    server.wait();
  }
  {
    test::Process server(serve("second.lcm"), folder_ / "serve.txt");
    ASSERT_TRUE(await_server(server, 3));
    EXPECT_EQ(why_reduced(), "emergency_stop");
    server.signal(SIGTERM);
    EXPECT_EQ(server.wait(), 0) << "it ends tidily, and the robot stands there still";
  }
  {
    test::Process server(serve("third.lcm"), folder_ / "serve.txt");
    ASSERT_TRUE(await_server(server, 4));
    EXPECT_EQ(why_reduced(), "emergency_stop");
    ASSERT_TRUE(emergency_stop(false, 5));
    server.signal(SIGKILL);
    server.wait();
  }
  test::Process server(serve("fourth.lcm"), folder_ / "serve.txt");
  ASSERT_TRUE(await_server(server, 6));
  EXPECT_EQ(test::bytes_of(folder_ / "serve.txt").find("emergency stop"), std::string::npos);
  EXPECT_NE(why_reduced(), "emergency_stop");
}

TEST_F(ServeTest, ServeExitsCleanlyWhenItsProcessGroupIsStopped) {
  auto arguments = serve("session.lcm");
  std::erase(arguments, "--no-restart");
  arguments.insert(arguments.begin(), {"300", test::program()});
  arguments.insert(arguments.end(), {"--report", folder_ / "report.json"});
  // timeout(1) forwards a signal to the process and to its group.
  test::Process server(arguments, folder_ / "serve.txt", "/usr/bin/timeout");
  ASSERT_TRUE(await_server(server, 1));
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0) << test::bytes_of(folder_ / "serve.txt");
  EXPECT_EQ(test::bytes_of(folder_ / "serve.txt").find("starting it again"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "report.json")) << "the session has come to its end";
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / ""))
    EXPECT_FALSE(entry.path().filename().string().starts_with("session-")) << entry.path();
}

TEST_F(ServeTest, ServeAndReplayRefuseUnwritablePathsBeforeRunning) {
  test::write_log(folder_ / "drive.lcm", test::drive(1));
  std::ofstream(folder_ / "there.json") << "{}";
  struct Case {
    std::string option, path, expected;
  };
  for (const Case& each :
       {Case{"--report", folder_ / "there.json", "exists"},
        Case{"--report", folder_ / "no/such/report.json", "no folder"},
        Case{"--report", folder_ / "", "is a folder"}, Case{"-o", folder_ / "drive.lcm", "exists"},
        Case{"-o", folder_ / "no/such/session.lcm", "no folder"}}) {
    for (const std::string command : {"replay", "serve"}) {
      std::vector<std::string> arguments{command, each.option, each.path};
      if (command == "serve") {
        arguments.insert(arguments.end(), {folder_ / "scenario.yaml", "--url", url_});
        if (each.option != "-o") arguments.insert(arguments.end(), {"-o", folder_ / "fresh.lcm"});
      } else {
        arguments.insert(arguments.end(), {folder_ / "drive.lcm", "--scenario", folder_ / "scenario.yaml"});
      }
      const auto ran = test::run(arguments, folder_ / "ran.txt");
      EXPECT_EQ(ran.exit, 1) << command << " " << each.path;
      EXPECT_NE(ran.output.find("parhelion " + command + ": " + each.path), std::string::npos) << ran.output;
      EXPECT_NE(ran.output.find(each.expected), std::string::npos) << ran.output;
      EXPECT_EQ(ran.output.find("scans"), std::string::npos) << "no summary: it never ran: " << ran.output;
    }
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "fresh.lcm"));
  EXPECT_EQ(test::bytes_of(folder_ / "there.json"), "{}");
}

TEST_F(ServeTest, InjectReceivesAReplyFromTheServer) {
  test::Process server(serve("session.lcm"), folder_ / "serve.txt");
  ASSERT_TRUE(await_server(server, 1));
  const auto inject = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "inject");
    arguments.insert(arguments.end(), {"--url", url_, "--timeout", "20"});
    return test::run(arguments, folder_ / "inject.txt");
  };
  EXPECT_EQ(inject({"spawn", "--name", "robot_9", "--kind", "robot", "--at", "2,1,90deg"}).exit, 0);
  const auto again = inject({"spawn", "--name", "robot_9", "--kind", "robot", "--at", "2,2"});
  EXPECT_EQ(again.exit, 1);
  EXPECT_NE(again.output.find("robot_9"), std::string::npos) << again.output;
  EXPECT_EQ(inject({"spawn", "--name", "x", "--at", "two"}).exit, 2);
  EXPECT_EQ(inject({"remove", "--name", "robot_9"}).exit, 0);
  EXPECT_EQ(inject({"fault", "--name", "camera_delay", "--amount", "0.3", "--lasting", "30"}).exit, 0);
  EXPECT_EQ(inject({"end-fault", "--name", "camera_delay"}).exit, 0);
  EXPECT_EQ(inject({"fault", "--name", "camera_delay"}).exit, 2);
  EXPECT_EQ(inject({"fault", "--name", "dead_wheel"}).exit, 2);
  EXPECT_EQ(inject({"fault", "--name", "camera_dely", "--amount", "0.3"}).exit, 2);
  const auto real = inject({"fault", "--name", "dead_wheel", "--side", "left"});
  EXPECT_EQ(real.exit, 1);
  EXPECT_NE(real.output.find("simulated"), std::string::npos) << real.output;
  const auto script = inject({"script", "--name", "door slams"});
  EXPECT_EQ(script.exit, 1);
  EXPECT_NE(script.output.find("no script"), std::string::npos) << script.output;
  const auto frozen = inject({"freeze", "--name", test::robot().name});
  EXPECT_EQ(frozen.exit, 1);
  EXPECT_NE(frozen.output.find("MR_EMERGENCY_STOP"), std::string::npos) << frozen.output;
  EXPECT_EQ(inject({"emergency-stop"}).exit, 0);
  EXPECT_EQ(why_reduced(), "emergency_stop");
  EXPECT_EQ(inject({"release-emergency-stop", "--name", test::robot().name}).exit, 0);
  server.signal(SIGINT);
  EXPECT_EQ(server.wait(), 0) << test::bytes_of(folder_ / "serve.txt");
}

}  // namespace
}  // namespace parhelion::tools
