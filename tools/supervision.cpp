#include "tools/supervision.hpp"

#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <sstream>

#include "tools/stop_signal.hpp"

namespace parhelion::tools {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kDeathsAtOnce = 5;
constexpr std::chrono::milliseconds kFirstPause{100}, kLongestPause{1000};
constexpr std::chrono::seconds kGoodService{10};

volatile std::sig_atomic_t child = 0;
volatile std::sig_atomic_t asked_to_stop = 0;
void pass_on(int signal) {
  asked_to_stop = 1;
  if (child > 0) kill(child, signal);
}

/// Holds back signals, so that none is lost between a check and a wait or while a server process starts.
class HeldSignals {
 public:
  HeldSignals() {
    sigset_t both;
    sigemptyset(&both);
    sigaddset(&both, SIGINT);
    sigaddset(&both, SIGTERM);
    sigprocmask(SIG_BLOCK, &both, &before_);
  }
  ~HeldSignals() { sigprocmask(SIG_SETMASK, &before_, nullptr); }
  HeldSignals(const HeldSignals&) = delete;
  HeldSignals& operator=(const HeldSignals&) = delete;

  const sigset_t& before() const { return before_; }

 private:
  sigset_t before_{};
};

/// In the new process: 0. In this one: its id, or -1 if it could not be created.
pid_t start_server() {
  const HeldSignals held;
  const pid_t supervisor = getpid(), made = fork();
  if (made != 0) {
    child = std::max(made, 0);
    if (child > 0 && asked_to_stop != 0) kill(child, SIGTERM);
    return made;
  }
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  // It may have died before that: nobody would stop the robot for this server.
  if (getppid() != supervisor) _exit(static_cast<int>(Exit::failed));
  catch_stop_signals();
  return 0;
}

/// Memory shared by this process and its children; nullptr: there is none.
ServerMemory* shared_memory() {
  void* memory =
      mmap(nullptr, sizeof(ServerMemory), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  return memory == MAP_FAILED ? nullptr : new (memory) ServerMemory;
}

/// Ends early when a stop is asked for.
void pause_for(std::chrono::milliseconds time) {
  const HeldSignals held;
  if (asked_to_stop != 0) return;
  const timespec left{time.count() / 1000, time.count() % 1000 * 1'000'000};
  (void)ppoll(nullptr, 0, &left, &held.before());
}

std::chrono::milliseconds pause_after(int deaths) {
  if (deaths <= kDeathsAtOnce) return std::chrono::milliseconds(0);
  return std::min(kLongestPause, kFirstPause * (1 << std::min(deaths - kDeathsAtOnce - 1, 10)));
}

int wait_for(pid_t server) {
  int status = 0;
  while (waitpid(server, &status, 0) < 0) {
  }
  child = 0;
  return status;
}

}  // namespace

void ServerMemory::set_robot_stops(const std::vector<runtime::RobotStop>& stops) {
  std::string text;
  for (const runtime::RobotStop& stop : stops) {
    text += stop.command_channel + '\n' + std::to_string(static_cast<int>(stop.command_type)) + '\n' +
            stop.joint_channel + '\n';
    for (const std::string& joint : stop.joints) text += joint + '\n';
    text += '\n';
  }
  stops_.set(text);
}

std::vector<runtime::RobotStop> ServerMemory::robot_stops() const {
  std::vector<runtime::RobotStop> stops;
  std::istringstream lines(stops_.get());
  for (std::string line; std::getline(lines, line);) {
    runtime::RobotStop& stop = stops.emplace_back();
    stop.command_channel = line;
    std::getline(lines, line);
    if (line == std::to_string(static_cast<int>(CommandType::mbot_motor)))
      stop.command_type = CommandType::mbot_motor;
    std::getline(lines, stop.joint_channel);
    while (std::getline(lines, line) && !line.empty()) stop.joints.push_back(line);
  }
  return stops;
}

Exit supervise(const Supervision& supervision) {
  std::signal(SIGINT, pass_on);
  std::signal(SIGTERM, pass_on);
  ServerMemory* memory = shared_memory();
  if (memory == nullptr) {
    supervision.notify("no memory to share with the server process");
    return Exit::failed;
  }
  int deaths = 0;
  for (int attempt = 0;; ++attempt) {
    const Clock::time_point started = Clock::now();
    const pid_t server = start_server();
    if (server == 0) {
      const Exit exit = supervision.serve(attempt, *memory);
      std::fflush(nullptr);
      _exit(static_cast<int>(exit));
    }
    if (server < 0 && attempt == 0) {
      supervision.notify("cannot start the server process");
      return Exit::failed;
    }
    std::string how = "the server process could not be started";
    if (server > 0) {
      const int status = wait_for(server);
      if (WIFEXITED(status)) {
        const auto exit = static_cast<Exit>(WEXITSTATUS(status));
        if (memory->ended || !memory->begun || asked_to_stop != 0) return exit;
        how = "the server ended before its session did";
      } else {
        how = "the server died (signal " + std::to_string(WTERMSIG(status)) + ")";
        for (const runtime::RobotStop& stop : memory->robot_stops()) supervision.stop_robot(stop);
        if (memory->ended) return Exit::failed;
      }
    }
    if (asked_to_stop != 0) {
      supervision.notify(how + " while it was stopping; its session log is cut off");
      return Exit::failed;
    }
    deaths = Clock::now() - started > kGoodService ? 1 : deaths + 1;
    supervision.notify(how + "; starting it again");
    pause_for(pause_after(deaths));
    if (asked_to_stop != 0) return Exit::failed;
  }
}

std::string session_after(const std::string& session) {
  const std::filesystem::path path(session);
  const std::string stem = (path.parent_path() / path.stem()).string();
  std::error_code ignored;
  int number = 2;
  while (std::filesystem::exists(stem + "-" + std::to_string(number) + ".lcm", ignored)) ++number;
  return stem + "-" + std::to_string(number) + ".lcm";
}

}  // namespace parhelion::tools
