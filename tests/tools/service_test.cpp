// `parhelion serve` under a service manager: this test has the manager's end of NOTIFY_SOCKET.
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstdlib>
#include <cstring>
#include <map>
#include <optional>
#include <thread>

#include "tests/tools/serve_fixture.hpp"
#include "tools/service/service_manager.hpp"

namespace parhelion::tools {
namespace {

constexpr Duration kWatchdog = milliseconds(400);

/// A message to the manager, and the process that sent it.
struct Notification {
  std::string text;
  pid_t sender = 0;
};

class NotifySocket {
 public:
  explicit NotifySocket(const std::string& path) : socket_(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    const int on = 1;
    EXPECT_EQ(setsockopt(socket_, SOL_SOCKET, SO_PASSCRED, &on, sizeof on), 0);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0) << path;
  }
  ~NotifySocket() { close(socket_); }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  /// nullopt: none in time.
  std::optional<Notification> receive(Duration timeout) const {
    pollfd wait{socket_, POLLIN, 0};
    if (poll(&wait, 1, static_cast<int>(timeout.ns / 1'000'000)) <= 0) return std::nullopt;
    char text[4096];
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(ucred))];
    iovec part{text, sizeof text};
    msghdr header{};
    header.msg_iov = &part;
    header.msg_iovlen = 1;
    header.msg_control = control;
    header.msg_controllen = sizeof control;
    const ssize_t size = recvmsg(socket_, &header, 0);
    if (size < 0) return std::nullopt;
    ucred sender{};
    if (const cmsghdr* found = CMSG_FIRSTHDR(&header); found != nullptr)
      std::memcpy(&sender, CMSG_DATA(found), sizeof sender);
    return Notification{std::string(text, static_cast<std::size_t>(size)), sender.pid};
  }
  /// The next message that begins with `text`; what comes before it is discarded.
  std::optional<Notification> await(const std::string& text) const {
    const WallTime deadline = runtime::steady_now() + seconds(20);
    while (runtime::steady_now() < deadline) {
      auto next = receive(deadline - runtime::steady_now());
      if (next && next->text.starts_with(text)) return next;
    }
    return std::nullopt;
  }
  void discard() const {
    while (receive(Duration{})) {
    }
  }

 private:
  int socket_;
};

/// Sets variables of the environment until its end.
class Environment {
 public:
  explicit Environment(const std::map<std::string, std::string>& variables) : variables_(variables) {
    for (const auto& [name, value] : variables_) setenv(name.c_str(), value.c_str(), 1);
  }
  ~Environment() {
    for (const auto& [name, value] : variables_) unsetenv(name.c_str());
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  std::map<std::string, std::string> variables_;
};

class ServiceTest : public test::ServeTest {
 protected:
  /// The supervised server. The shell sets `assignment`, such as "WATCHDOG_PID=$$", in the process that
  /// becomes the server's supervisor.
  std::unique_ptr<test::Process> start(const std::string& assignment) {
    auto arguments = serve("session.lcm");
    std::erase(arguments, "--no-restart");
    arguments.insert(arguments.begin(), {"-c", assignment + " exec \"$0\" \"$@\"", test::program()});
    return std::make_unique<test::Process>(arguments, log(), "/bin/sh");
  }
  std::unique_ptr<test::Process> start_notifying() {
    const Environment environment(
        {{"NOTIFY_SOCKET", folder_ / "notify"}, {"WATCHDOG_USEC", std::to_string(kWatchdog.ns / 1000)}});
    return start("WATCHDOG_PID=$$");
  }
  bool answers_a_scan() {
    const Message scan = test::message(channel::kScan, 0, test::scan_at(1));
    EXPECT_TRUE(bus_->publish(scan.channel, scan.payload).ok());
    Message message;
    const WallTime deadline = runtime::steady_now() + seconds(20);
    while (runtime::steady_now() < deadline) {
      const auto received = bus_->receive(message, deadline - runtime::steady_now());
      if (received.ok() && *received && message.channel == channel::kMrScan) return true;
    }
    return false;
  }
  std::string log() const { return folder_ / "serve.txt"; }

  NotifySocket manager_{folder_ / "notify"};
};

TEST_F(ServiceTest, TheServerReportsReadinessAndItsLoopFeedsTheWatchdog) {
  const auto server = start_notifying();
  const auto ready = manager_.await("READY=1");
  ASSERT_TRUE(ready) << test::bytes_of(log());
  EXPECT_TRUE(answers_a_scan());
  const pid_t child = child_of(*server);
  EXPECT_EQ(ready->sender, child) << "the process that answers scans";
  for (int i = 0; i < 5; ++i) {
    const auto fed = manager_.await("WATCHDOG=1");
    ASSERT_TRUE(fed) << i;
    EXPECT_EQ(fed->sender, child);
  }

  kill(child, SIGSTOP);
  while (test::bytes_of("/proc/" + std::to_string(child) + "/stat").find(") T ") == std::string::npos)
    std::this_thread::yield();
  manager_.discard();
  const auto late = manager_.receive(Duration{3 * kWatchdog.ns});
  EXPECT_FALSE(late) << late->text;

  kill(child, SIGCONT);
  EXPECT_TRUE(manager_.await("WATCHDOG=1"));
  server->signal(SIGTERM);
  const auto stopping = manager_.await("STOPPING=1");
  ASSERT_TRUE(stopping);
  EXPECT_EQ(stopping->sender, child);
  EXPECT_EQ(server->wait(), 0) << test::bytes_of(log());
}

TEST_F(ServiceTest, ARestartOfTheServerKeepsTheService) {
  const auto server = start_notifying();
  const auto first = manager_.await("READY=1");
  ASSERT_TRUE(first) << test::bytes_of(log());
  kill(first->sender, SIGKILL);
  const auto died = manager_.await("STATUS=the server died");
  ASSERT_TRUE(died);
  EXPECT_EQ(died->sender, server->pid());
  const auto second = manager_.await("READY=1");
  ASSERT_TRUE(second) << test::bytes_of(log());
  EXPECT_NE(second->sender, first->sender);
  EXPECT_NE(second->sender, server->pid()) << "the supervisor answers no scans";
  const auto fed = manager_.await("WATCHDOG=1");
  ASSERT_TRUE(fed);
  EXPECT_EQ(fed->sender, second->sender);
  EXPECT_TRUE(server->running()) << "a manager takes the end of this process as the end of the service";
  server->signal(SIGTERM);
  EXPECT_EQ(server->wait(), 0) << test::bytes_of(log());
}

TEST_F(ServiceTest, StatesWhatItWaitsForBeforeItIsReady) {
  Scenario scenario;
  scenario.name = "waits";
  scenario.model = "model.yaml";
  std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
  const auto server = start_notifying();
  const auto first = manager_.receive(seconds(20));
  ASSERT_TRUE(first) << test::bytes_of(log());
  EXPECT_TRUE(first->text.starts_with("STATUS=waiting for the robot description")) << first->text;
  const auto early = manager_.receive(kWatchdog);
  EXPECT_FALSE(early) << early->text;
}

TEST_F(ServiceTest, LinesHavePrioritiesOnlyInTheJournal) {
  for (const bool journal : {false, true}) {
    const auto server =
        start(journal ? "JOURNAL_STREAM=$(stat -L -c %d:%i /dev/fd/2)" : "JOURNAL_STREAM=1:2");
    ASSERT_TRUE(await_server(*server, 1));
    kill(child_of(*server), SIGKILL);
    ASSERT_TRUE(await_server(*server, 2));
    server->signal(SIGTERM);
    EXPECT_EQ(server->wait(), 0);
    const std::string lines = "\n" + test::bytes_of(log());
    EXPECT_EQ(lines.find("\n<6>parhelion serve: serving") != std::string::npos, journal) << lines;
    EXPECT_EQ(lines.find("\n<3>parhelion serve: the server died") != std::string::npos, journal) << lines;
  }
}

TEST_F(ServiceTest, RefusesMalformedVariablesOfTheManager) {
  for (const auto& [name, value] : std::map<std::string, std::string>{
           {"NOTIFY_SOCKET", "run/notify"}, {"WATCHDOG_USEC", "soon"}, {"WATCHDOG_PID", "-3"}}) {
    std::map<std::string, std::string> variables{{"NOTIFY_SOCKET", folder_ / "notify"}};
    variables[name] = value;
    const Environment environment(variables);
    const auto ran = test::run(serve("session.lcm"), log());
    EXPECT_EQ(ran.exit, 1);
    EXPECT_NE(ran.output.find(name + "='" + value + "': expected"), std::string::npos) << ran.output;
  }
}

TEST_F(ServiceTest, AManagerWithAFullQueueDelaysNothingAndMissesNothing) {
  const Environment environment({{"NOTIFY_SOCKET", folder_ / "notify"}, {"WATCHDOG_USEC", "1"}});
  auto service = ServiceManager::from_environment();
  ASSERT_TRUE(service.ok()) << service.error().message;
  for (int i = 0; i < 10'000; ++i) service->status("much\nto say");  // would wait for ever if it waited
  service->loop_runs();
  int queued = 0;
  for (auto next = manager_.receive(Duration{}); next; next = manager_.receive(Duration{}), ++queued)
    EXPECT_EQ(next->text, "STATUS=much to say");
  EXPECT_GT(queued, 0);
  EXPECT_LT(queued, 10'000) << "the queue was not full";
  service->loop_runs();
  EXPECT_TRUE(manager_.await("READY=1"));
  EXPECT_TRUE(manager_.await("WATCHDOG=1"));
}

TEST_F(ServiceTest, AServerAfterOneWhoseLoopEndedIsWatchedAgain) {
  const Environment environment({{"NOTIFY_SOCKET", folder_ / "notify"}, {"WATCHDOG_USEC", "400000"}});
  auto service = ServiceManager::from_environment();
  ASSERT_TRUE(service.ok()) << service.error().message;
  service->loop_ended();
  const auto unwatched = manager_.receive(Duration{});
  ASSERT_TRUE(unwatched);
  EXPECT_EQ(unwatched->text, "WATCHDOG_USEC=0");
  service->loop_runs();
  const auto ready = manager_.receive(Duration{});
  ASSERT_TRUE(ready);
  EXPECT_EQ(ready->text, "READY=1\nWATCHDOG_USEC=400000");
}

TEST_F(ServiceTest, TheWatchdogOfAnotherProcessIsNotFed) {
  const Environment environment(
      {{"NOTIFY_SOCKET", folder_ / "notify"}, {"WATCHDOG_USEC", "1"}, {"WATCHDOG_PID", "1"}});
  auto service = ServiceManager::from_environment();
  ASSERT_TRUE(service.ok()) << service.error().message;
  for (int i = 0; i < 3; ++i) service->loop_runs();
  const auto ready = manager_.receive(Duration{});
  ASSERT_TRUE(ready);
  EXPECT_EQ(ready->text, "READY=1");
  EXPECT_FALSE(manager_.receive(Duration{}));
}

}  // namespace
}  // namespace parhelion::tools
