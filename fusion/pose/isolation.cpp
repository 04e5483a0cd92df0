#include "fusion/pose/isolation.hpp"

#include <fcntl.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <mutex>
#include <new>
#include <string_view>

namespace parhelion::pose {
namespace {

constexpr int kOutOfMemory = 4;                              // exit code
constexpr std::uint64_t kResultFollows = ~std::uint64_t{0};  // in place of a report

/// Held from the pipe to the fork, so that no other child inherits the pipe's writing end and keeps it open.
std::mutex forking;

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

[[noreturn]] void run_child(int pipe_end, const ChildLimits& limits, const Work& work) {
  be_silent();
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

struct Child {
  pid_t pid;
  int pipe_end;  ///< reading
};

Result<Child> start(const ChildLimits& limits, const Work& work) {
  std::unique_lock lock(forking);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0)
    return Error{std::string("no pipe to a child process: ") + std::strerror(errno)};
  const pid_t child = fork();
  if (child < 0) {
    close(ends[0]);
    close(ends[1]);
    return Error{std::string("no child process: ") + std::strerror(errno)};
  }
  if (child == 0) {
    lock.unlock();  // the child may start children
    close(ends[0]);
    run_child(ends[1], limits, work);
  }
  close(ends[1]);
  return Child{child, ends[0]};
}

/// Up to `size` bytes; fewer at the end of the child.
std::size_t read_up_to(int pipe_end, char* bytes, std::size_t size) {
  std::size_t done = 0;
  while (done < size) {
    const ssize_t got = read(pipe_end, bytes + done, size - done);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

ChildEnd wait_for(const Child& child) {
  close(child.pipe_end);
  int status = 0;
  rusage used{};
  while (wait4(child.pid, &status, 0, &used) < 0 && errno == EINTR) {
  }
  ChildEnd end;
  end.seconds = seconds_of(used.ru_utime) + seconds_of(used.ru_stime);
  end.completed = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  end.out_of_memory = WIFEXITED(status) && WEXITSTATUS(status) == kOutOfMemory;
  end.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  end.out_of_time = end.signal == SIGXCPU || end.signal == SIGKILL;
  return end;
}

}  // namespace

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

Result<ChildResult> result_of_child(
    const ChildLimits& limits,
    const std::function<std::string(const std::function<void(std::uint64_t)>&)>& work,
    const std::function<void(std::uint64_t)>& on_report) {
  const auto child = start(limits, [&work](int pipe_end) {
    const auto report = [pipe_end](std::uint64_t at) {
      write_all(pipe_end, {reinterpret_cast<const char*>(&at), sizeof at});
    };
    const std::string bytes = work(report);
    report(kResultFollows);
    write_all(pipe_end, bytes);
  });
  if (!child) return child.error();
  ChildResult result;
  std::optional<std::uint64_t> last;
  std::uint64_t at = 0;
  while (read_up_to(child->pipe_end, reinterpret_cast<char*>(&at), sizeof at) == sizeof at &&
         at != kResultFollows) {
    last = at;
    if (on_report) on_report(at);
  }
  char block[1 << 16];
  while (const std::size_t got = read_up_to(child->pipe_end, block, sizeof block))
    result.bytes.append(block, got);
  result.end = wait_for(*child);
  result.end.last = last;
  if (!result.end.completed) result.bytes.clear();
  return result;
}

std::string describe(const ChildEnd& end, const ChildLimits& limits) {
  if (end.completed) return "completed";
  if (end.out_of_memory) return "needs more than " + std::to_string(limits.bytes >> 20U) + " MB";
  if (end.out_of_time)
    return "needs more than " + std::to_string(limits.seconds) + " s of processor time, or was killed";
  if (end.signal != 0) return std::string("crashed (") + strsignal(end.signal) + ")";
  return "ended with an unexpected error";
}

}  // namespace parhelion::pose
