// The built program as a separate process.
#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/file_bytes.hpp"

namespace parhelion::test {

/// A bus of this machine that no other test process has; another group for a second bus.
inline std::string bus_url(int group = 67) {
  return "udpm://239.255.76." + std::to_string(group) + ":" + std::to_string(20'000 + getpid() % 20'000) +
         "?ttl=0";
}

inline std::string program() { return std::string(PARHELION_BINARY_DIR) + "/tools/parhelion"; }

/// Runs until it ends or is killed, at the latest by the destructor.
class Process {
 public:
  /// Output and errors go to the file `log`.
  Process(std::vector<std::string> arguments, const std::string& log, const std::string& path = program()) {
    std::vector<char*> argv{const_cast<char*>("parhelion")};
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ != 0) return;
    const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    dup2(file, STDOUT_FILENO);
    dup2(file, STDERR_FILENO);
    execv(path.c_str(), argv.data());
    _exit(127);
  }
  ~Process() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    (void)wait();
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  void signal(int number) const { kill(pid_, number); }
  /// Exit code, or 128 + the signal that ended it.
  int wait() {
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  bool running() {
    int status = 0;
    if (pid_ > 0 && waitpid(pid_, &status, WNOHANG) == pid_) pid_ = -1;
    return pid_ > 0;
  }

 private:
  pid_t pid_ = -1;
};

/// The first process that `parent` has started; 0: none.
inline pid_t child_of(pid_t parent) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream stat(entry.path() / "stat");
    pid_t pid = 0, its_parent = 0;
    std::string name, state;
    if (stat >> pid >> name >> state >> its_parent && its_parent == parent) return pid;
  }
  return 0;
}

struct Ran {
  int exit = -1;
  std::string output;
};

inline Ran run(const std::vector<std::string>& arguments, const std::string& log,
               const std::string& path = program()) {
  Process process(arguments, log, path);
  const int exit = process.wait();
  return {exit, bytes_of(log)};
}

}  // namespace parhelion::test
