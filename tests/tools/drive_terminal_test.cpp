// `parhelion drive` as a process in a terminal of its own: typed keys are published as commands.
#include <fcntl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>

#include "protocols/bus/bus.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

/// The program at the other end of a pseudo terminal.
class Terminal {
 public:
  Terminal() : keys_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    if (keys_ < 0 || grantpt(keys_) != 0 || unlockpt(keys_) != 0) return;
    const std::string side = ptsname(keys_), program = test::program(), where = test::bus_url(69);
    pid_ = fork();
    if (pid_ != 0) return;
    setsid();
    const int file = open(side.c_str(), O_RDWR);
    for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(file, standard);
    execl(program.c_str(), "parhelion", "drive", "--url", where.c_str(), nullptr);
    _exit(127);
  }
  ~Terminal() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    if (keys_ >= 0) close(keys_);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  bool ok() const { return pid_ > 0; }
  void type(const std::string& keys) const {
    ASSERT_EQ(write(keys_, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
  }
  /// Reads the screen, so that the program can continue to write.
  void look() {
    char text[4096];
    for (ssize_t n = read(keys_, text, sizeof text); n > 0; n = read(keys_, text, sizeof text))
      screen.append(text, static_cast<std::size_t>(n));
  }
  int exit_code() {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) != pid_) return -1;
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
  }
  std::string screen;

 private:
  int keys_ = -1;
  pid_t pid_ = -1;
};

class DriveTerminalTest : public testing::Test {
 protected:
  void SetUp() override {
    auto bus = open_network_bus(test::bus_url(69));
    ASSERT_TRUE(bus.ok()) << bus.error().message;
    bus_ = std::move(*bus);
    for (const char* name : {channel::kJointCmd, channel::kTeleop, channel::kOperators})
      ASSERT_TRUE(bus_->subscribe(name, 100).ok());
  }
  /// Publishes robot and joints and receives the console's messages, until `done`; `keys` are typed each
  /// time, as a held key repeats.
  bool until(Terminal& terminal, const std::string& keys, const std::function<bool()>& done) {
    WorldMessage world;
    world.robot = "trainee";  // without bodies: its pose is unknown
    for (const WallTime end = runtime::steady_now() + seconds(20); !done() && runtime::steady_now() < end;) {
      world.stamp = {runtime::wall_now().ns};
      publish(channel::kMrWorld, world);
      publish(channel::kJointState, Joints{world.stamp, {"turret", "finger"}, {0, 0}, {0, 0}, {}});
      if (!keys.empty()) terminal.type(keys);
      terminal.look();
      Message message;
      auto came = bus_->receive(message, milliseconds(30));
      for (; came.ok() && *came; came = bus_->receive(message, Duration{0})) take(message);
    }
    return done();
  }
  template <class T>
  void publish(const char* channel, const T& item) {
    std::vector<std::uint8_t> payload;
    encode(item, payload);
    ASSERT_TRUE(bus_->publish(channel, payload).ok());
  }
  void take(const Message& message) {
    TwistCommand twist;
    if (message.channel == channel::kJointCmd) {
      ASSERT_TRUE(decode(message.channel, message.payload, joints_).ok());
    } else if (message.channel == channel::kOperators) {
      ASSERT_TRUE(decode(message.channel, message.payload, operator_status_).ok());
    } else if (decode(message.channel, message.payload, twist).ok()) {
      speed_ = twist.twist.vx;
    }
  }
  bool moves(const std::string& joint, double direction) const {
    return joints_.names == std::vector{joint} && joints_.velocities.size() == 1 &&
           (direction == 0 ? joints_.velocities[0] == 0 : direction * joints_.velocities[0] > 0);
  }

  std::unique_ptr<Bus> bus_;
  Joints joints_;
  OperatorStatus operator_status_;
  double speed_ = 0;
};

TEST_F(DriveTerminalTest, KeysMoveTheChosenJointAndDriveAndQuit) {
  Terminal terminal;
  ASSERT_TRUE(terminal.ok());
  ASSERT_TRUE(until(terminal, "", [&] {
    return operator_status_.robot == "trainee" && terminal.screen.find("joint turret") != std::string::npos;
  })) << terminal.screen;
  EXPECT_TRUE(until(terminal, "r", [&] { return moves("turret", 1); })) << terminal.screen;
  terminal.type("]");
  EXPECT_TRUE(until(terminal, "f", [&] { return moves("finger", -1); })) << terminal.screen;
  terminal.type(" ");
  EXPECT_TRUE(until(terminal, "", [&] { return moves("finger", 0); })) << terminal.screen;
  EXPECT_TRUE(until(terminal, "w", [&] { return speed_ > 0; })) << terminal.screen;
  terminal.type(" ");
  EXPECT_TRUE(until(terminal, "", [&] { return speed_ == 0; })) << terminal.screen;
  terminal.type("x");
  int exit = -1;
  EXPECT_TRUE(until(terminal, "", [&] {
    if (exit < 0) exit = terminal.exit_code();
    return exit >= 0 && operator_status_.state == OperatorStatus::State::ended;
  })) << terminal.screen;
  EXPECT_EQ(exit, 0) << terminal.screen;
}

}  // namespace
}  // namespace parhelion::tools
