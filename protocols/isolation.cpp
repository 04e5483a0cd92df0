#include "protocols/isolation.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <string_view>
#include <utility>
#include <vector>

namespace parhelion {
namespace {

constexpr int kOutOfMemory = 4;                              // exit code
constexpr std::uint64_t kResultFollows = ~std::uint64_t{0};  // in place of a report

void be_silent() {
  const int null = open("/dev/null", O_WRONLY);
  if (null < 0) return;
  dup2(null, STDOUT_FILENO);
  dup2(null, STDERR_FILENO);
  close(null);
}

void write_all(int pipe_end, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(pipe_end, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) _exit(2);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

/// `work` gets the writing end of a pipe to the parent.
using Work = std::function<void(int pipe_end)>;

[[noreturn]] void run_child(pid_t parent, int pipe_end, const ChildLimits& limits, const Work& work) {
  be_silent();
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(3);  // it died before that
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const rlimit time{limits.seconds, limits.seconds + 1};
  setrlimit(RLIMIT_CPU, &time);
  const AllocationLimit memory(limits.bytes);
  try {
    work(pipe_end);
  } catch (const std::bad_alloc&) {
    _exit(kOutOfMemory);
  } catch (const std::exception&) {
    _exit(3);
  }
  // Skips destructors and does not flush buffers of the parent.
  _exit(0);
}

class Child {
 public:
  static Result<Child> start(const ChildLimits& limits, const Work& work) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
      return Error{std::string("no pipe to a child process: ") + std::strerror(errno)};
    const pid_t parent = getpid(), pid = fork();
    if (pid < 0) {
      const Error error{std::string("no child process: ") + std::strerror(errno)};
      close(ends[0]);
      close(ends[1]);
      return error;
    }
    if (pid == 0) {
      close(ends[0]);
      run_child(parent, ends[1], limits, work);
    }
    close(ends[1]);
    return Child(pid, ends[0]);
  }

  int pipe_end() const { return pipe_end_; }

  /// Waits for what the child sends next, and gives its reports to `on_report`. False: it sends no more.
  bool receive(const std::function<void(std::uint64_t)>& on_report) {
    char block[1 << 16];
    const ssize_t got = read(pipe_end_, block, sizeof block);
    if (got <= 0) return got < 0 && errno == EINTR;
    received_.append(block, static_cast<std::size_t>(got));
    take_reports(on_report);
    return true;
  }

  ChildResult finish() {
    ChildResult result;
    result.end = wait_for_end();
    result.end.last = last_;
    if (result.end.completed && result_follows_) result.bytes = std::move(received_);
    return result;
  }

 private:
  Child(pid_t pid, int pipe_end) : pid_(pid), pipe_end_(pipe_end) {}

  void take_reports(const std::function<void(std::uint64_t)>& on_report) {
    std::size_t taken = 0;
    for (std::uint64_t at = 0; !result_follows_ && received_.size() - taken >= sizeof at;) {
      std::memcpy(&at, received_.data() + taken, sizeof at);
      taken += sizeof at;
      result_follows_ = at == kResultFollows;
      if (result_follows_) break;
      last_ = at;
      if (on_report) on_report(at);
    }
    received_.erase(0, taken);
  }
  ChildEnd wait_for_end() const;

  pid_t pid_;
  int pipe_end_;  ///< reading
  std::string received_;
  bool result_follows_ = false;
  std::optional<std::uint64_t> last_;
};

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

ChildEnd Child::wait_for_end() const {
  close(pipe_end_);
  int status = 0;
  rusage used{};
  while (wait4(pid_, &status, 0, &used) < 0 && errno == EINTR) {
  }
  ChildEnd end;
  end.seconds = seconds_of(used.ru_utime) + seconds_of(used.ru_stime);
  end.completed = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  end.out_of_memory = WIFEXITED(status) && WEXITSTATUS(status) == kOutOfMemory;
  end.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  end.out_of_time = end.signal == SIGXCPU || end.signal == SIGKILL;
  return end;
}

/// Sends the reports of `work`, then its result.
Work sending(const WorkOfChild& work) {
  return [&work](int pipe_end) {
    const auto report = [pipe_end](std::uint64_t at) {
      write_all(pipe_end, {reinterpret_cast<const char*>(&at), sizeof at});
    };
    const std::string bytes = work(report);
    report(kResultFollows);
    write_all(pipe_end, bytes);
  };
}

}  // namespace

#ifdef PARHELION_ADDRESS_SANITIZER
AllocationLimit::AllocationLimit(std::uint64_t) {}
#else
AllocationLimit::AllocationLimit(std::uint64_t headroom) {
  std::FILE* statm = std::fopen("/proc/self/statm", "r");
  unsigned long pages = 0;
  const bool known = statm != nullptr && std::fscanf(statm, "%lu", &pages) == 1;
  if (statm != nullptr) std::fclose(statm);
  if (!known || getrlimit(RLIMIT_AS, &before_) != 0) return;
  rlimit limit = before_;
  const auto wanted = static_cast<rlim_t>(pages) * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + headroom;
  limit.rlim_cur = std::min<rlim_t>(before_.rlim_cur, wanted);
  active_ = setrlimit(RLIMIT_AS, &limit) == 0;
}
#endif

AllocationLimit::~AllocationLimit() {
  if (active_) setrlimit(RLIMIT_AS, &before_);
}

Result<ChildEnd> run_in_child(const ChildLimits& limits,
                              const std::function<void(const std::function<void(std::uint64_t)>&)>& work) {
  auto result = result_of_child(limits, [&work](const auto& report) {
    work(report);
    return std::string();
  });
  if (!result) return result.error();
  return result->end;
}

Result<ChildResult> result_of_child(const ChildLimits& limits, const WorkOfChild& work,
                                    const std::function<void(std::uint64_t)>& on_report) {
  auto child = Child::start(limits, sending(work));
  if (!child) return child.error();
  while (child->receive(on_report)) {
  }
  return child->finish();
}

void results_of_children(std::size_t count, std::size_t at_once,
                         const std::function<ChildTask(std::size_t)>& task,
                         const std::function<void(std::size_t, Result<ChildResult>)>& on_result) {
  std::vector<std::pair<std::size_t, Child>> running;
  std::vector<pollfd> pipes;
  for (std::size_t next = 0; next < count || !running.empty();) {
    for (; next < count && running.size() < std::max<std::size_t>(at_once, 1); ++next) {
      const ChildTask todo = task(next);
      auto child = Child::start(todo.limits, sending(todo.work));
      if (child) {
        running.emplace_back(next, std::move(*child));
      } else {
        on_result(next, child.error());
      }
    }
    pipes.clear();
    for (const auto& [index, child] : running) pipes.push_back({child.pipe_end(), POLLIN, 0});
    poll(pipes.data(), pipes.size(), -1);
    for (std::size_t i = running.size(); i-- > 0;) {
      if (pipes[i].revents == 0 || running[i].second.receive({})) continue;
      on_result(running[i].first, running[i].second.finish());
      running.erase(running.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
}

std::string describe(const ChildEnd& end, const ChildLimits& limits) {
  if (end.completed) return "completed";
  if (end.out_of_memory) return "needs more than " + std::to_string(limits.bytes >> 20U) + " MB";
  if (end.out_of_time)
    return "needs more than " + std::to_string(limits.seconds) + " s of processor time, or was killed";
  if (end.signal != 0) return std::string("crashed (") + strsignal(end.signal) + ")";
  return "ended with an unexpected error";
}

}  // namespace parhelion
