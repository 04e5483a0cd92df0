// A live server on a network with another machine: two network namespaces joined by a cable.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sched.h>

#include <cstdlib>
#include <thread>

#include "server/runtime/wall_clock.hpp"
#include "tests/protocols/raw_datagrams.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"
#include "tools/robot_bus_guard.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kServerAddress = "10.77.0.1";
constexpr const char* kOtherAddress = "10.77.0.2";

/// As long as it lives, what the calling thread opens or starts is in the namespace.
class InNamespace {
 public:
  explicit InNamespace(const std::string& name) : before_(open("/proc/thread-self/ns/net", O_RDONLY)) {
    const int there = open(("/run/netns/" + name).c_str(), O_RDONLY);
    EXPECT_EQ(setns(there, CLONE_NEWNET), 0) << name;
    close(there);
  }
  ~InNamespace() {
    EXPECT_EQ(setns(before_, CLONE_NEWNET), 0);
    close(before_);
  }
  InNamespace(const InNamespace&) = delete;
  InNamespace& operator=(const InNamespace&) = delete;

 private:
  int before_;
};

class OtherHostsTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!ip("netns add " + here_) || !ip("netns add " + there_))
      GTEST_SKIP() << "network namespaces need root and iproute2";
    if (!ip("link add " + here_ + " netns " + here_ + " type veth peer name " + there_ + " netns " + there_))
      GTEST_SKIP() << "this machine has no virtual cables";
    connect(here_, kServerAddress);
    connect(there_, kOtherAddress);
    std::ofstream(folder_ / "model.yaml") << to_yaml(test::room());
    std::ofstream(folder_ / "robot.yaml") << to_yaml(test::robot());
  }
  void TearDown() override {
    ip("netns del " + here_);
    ip("netns del " + there_);
  }

  static bool ip(const std::string& arguments) {
    return std::system(("ip " + arguments + " 2>/dev/null").c_str()) == 0;
  }
  static void connect(const std::string& name, const char* address) {
    const std::string in = "-n " + name + " ";
    ASSERT_TRUE(ip(in + "addr add " + address + "/24 dev " + name));
    ASSERT_TRUE(ip(in + "link set " + name + " up"));
    ASSERT_TRUE(ip(in + "link set lo up multicast on"));
    ASSERT_TRUE(ip(in + "route add 224.0.0.0/4 dev " + name));
  }
  std::vector<std::string> serve(const std::vector<std::string>& hosts) {
    Scenario scenario;
    scenario.name = "two machines";
    scenario.model = "model.yaml";
    scenario.robot = "robot.yaml";
    scenario.hosts = hosts;
    std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
    return {"serve",
            folder_ / "scenario.yaml",
            "-o",
            folder_ / "session.lcm",
            "--url",
            kUrl,
            "--no-restart",
            "--state-folder",
            folder_ / "state"};
  }
  static std::unique_ptr<Bus> open_in(const std::string& name) {
    const InNamespace there(name);
    auto bus = open_network_bus(kUrl);
    EXPECT_TRUE(bus) << bus.error().message;
    if (!bus) return nullptr;
    EXPECT_TRUE((*bus)->subscribe("MR_CMD", 64));
    return std::move(*bus);
  }
  static Message teleop(double speed) {
    return test::message(channel::kTeleop, 0, TwistCommand{{runtime::wall_now().ns}, {speed, 0, 0}});
  }
  static std::optional<double> newest_command(Bus& bus) {
    std::optional<double> speed;
    Message message;
    TwistCommand command;
    while (*bus.receive(message, milliseconds(20))) {
      if (decode(message.channel, message.payload, command)) speed = command.twist.vx;
    }
    return speed;
  }
  /// Whether `driver` moves the robot. After the stick was let go, the robot may crawl without a pose.
  static bool drives(Bus& driver, int attempts) {
    std::optional<double> command;
    const auto answered = [&](double speed) { return command && (speed == 0 || *command > 0); };
    for (const double speed : {0.0, 0.3}) {
      for (int i = 0; i < attempts && !answered(speed); ++i) {
        EXPECT_TRUE(driver.publish(channel::kTeleop, teleop(speed).payload));
        if (const auto now = newest_command(driver)) command = now;
      }
    }
    return answered(0.3);
  }

  /// After the last TELEOP.
  static bool stops(Bus& bus) {
    std::optional<double> command;
    for (int i = 0; i < 200 && command.value_or(1) != 0; ++i) {
      if (const auto now = newest_command(bus)) command = now;
    }
    return command == 0;
  }

  static constexpr const char* kUrl = "udpm://239.255.76.67:7667?ttl=1";
  const std::string here_ = "ph" + std::to_string(getpid()) + "a",
                    there_ = "ph" + std::to_string(getpid()) + "b";
  test::TemporaryFolder folder_;
};

TEST_F(OtherHostsTest, AHostThatTheScenarioDoesNotListMovesNothingAndIsNamed) {
  const auto own = open_in(here_), other = open_in(there_);
  ASSERT_TRUE(own && other);
  const InNamespace here(here_);
  test::Process server(serve({}), folder_ / "serve.txt");
  ASSERT_TRUE(drives(*own, 200)) << test::bytes_of(folder_ / "serve.txt");
  ASSERT_TRUE(stops(*own));
  EXPECT_FALSE(drives(*other, 50));
  const std::string expected = std::string("messages of ") + kOtherAddress + " are refused";
  EXPECT_NE(test::bytes_of(folder_ / "serve.txt").find(expected), std::string::npos)
      << test::bytes_of(folder_ / "serve.txt");
}

TEST_F(OtherHostsTest, AListedHostDrives) {
  const auto other = open_in(there_);
  ASSERT_TRUE(other);
  const InNamespace here(here_);
  test::Process server(serve({kOtherAddress}), folder_ / "serve.txt");
  EXPECT_TRUE(drives(*other, 200)) << test::bytes_of(folder_ / "serve.txt");
}

TEST_F(OtherHostsTest, ADatagramToTheMachinesOwnAddressMovesNothing) {
  const auto own = open_in(here_);
  ASSERT_TRUE(own);
  const InNamespace here(here_);
  test::Process server(serve({kOtherAddress}), folder_ / "serve.txt");
  ASSERT_TRUE(drives(*own, 200)) << test::bytes_of(folder_ / "serve.txt");
  ASSERT_TRUE(stops(*own));
  const InNamespace there(there_);
  const test::RawSender sender(kUrl, kServerAddress);
  for (int i = 0; i < 50; ++i) {
    sender.send(test::short_message(teleop(0.3)));
    EXPECT_EQ(newest_command(*own).value_or(0), 0);
  }
}

/// Receives as liblcm does: on every address of the machine.
class Motor {
 public:
  explicit Motor(const std::string& url)
      : file_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    const auto group = parse_lcm_url(url);
    const int on = 1;
    EXPECT_EQ(setsockopt(file_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on), 0);
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_port = htons(group->port);
    EXPECT_EQ(bind(file_, reinterpret_cast<const sockaddr*>(&any), sizeof any), 0);
    const ip_mreq membership{group->address, {}};
    EXPECT_EQ(setsockopt(file_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership), 0);
  }
  ~Motor() { close(file_); }
  Motor(const Motor&) = delete;
  Motor& operator=(const Motor&) = delete;

  /// Datagrams with this word, until none has come for 100 ms.
  int received(const std::string& word) const {
    int count = 0;
    char bytes[65536];
    pollfd waiting{file_, POLLIN, 0};
    while (poll(&waiting, 1, 100) > 0) {
      const ssize_t size = recv(file_, bytes, sizeof bytes, 0);
      count += size > 0 &&
               std::string_view(bytes, static_cast<std::size_t>(size)).find(word) != std::string_view::npos;
    }
    return count;
  }

 private:
  const int file_;
};

TEST_F(OtherHostsTest, WithARelayNoOtherMachineReachesAMotorOnTheRobotsOwnBus) {
  constexpr const char* kOpen = "udpm://239.255.76.68:7668?ttl=1";  // as a stranger would send
  constexpr const char* kRobot = "udpm://239.255.76.68:7668?ttl=0";
  const auto attack = [&](const char* word) {
    const InNamespace there(there_);
    const test::RawSender to_group(kOpen), to_address(kOpen, kServerAddress);
    for (int i = 0; i < 20; ++i) {
      for (const auto* sender : {&to_group, &to_address})
        sender->send(test::short_message({word, {}, {1, 2, 3}}));
    }
  };
  const InNamespace here(here_);
  {
    const Motor motor(kRobot);
    attack("BEFORE");
    EXPECT_GT(motor.received("BEFORE"), 0) << "the attack itself works";
    EXPECT_NE(open_group(kRobot).find("ip route add 239.255.76.68/32 dev lo"), std::string::npos);
  }
  ASSERT_TRUE(ip("route add 239.255.76.68/32 dev lo src 127.0.0.1"));
  EXPECT_EQ(open_group(kRobot), "");
  ASSERT_EQ(test::run({"key", "new", "rover", "--role", "robot", "--server", folder_ / "server.keys", "-o",
                       folder_ / "rover.keys"},
                      folder_ / "key.txt")
                .exit,
            0);
  test::Process relay({"relay", "--keys", folder_ / "rover.keys", "--url", kUrl, "--robot-url", kRobot},
                      folder_ / "relay.txt");
  const Motor motor(kRobot);
  for (int i = 0; i < 200 && test::bytes_of(folder_ / "relay.txt").find("stop with ^C") == std::string::npos;
       ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  attack("AFTER");
  EXPECT_EQ(motor.received("AFTER"), 0) << test::bytes_of(folder_ / "relay.txt");
  test::RawSender(kRobot).send(test::short_message({"OWN", {}, {1}}));
  EXPECT_EQ(motor.received("OWN"), 1) << "the robot's own programs";
}

}  // namespace
}  // namespace parhelion::tools
