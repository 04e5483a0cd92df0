#include "fusion/pose/isolation.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>

namespace parhelion::pose {
namespace {

void be_silent() {
  const int null = open("/dev/null", O_WRONLY);
  if (null < 0) return;
  dup2(null, STDOUT_FILENO);
  dup2(null, STDERR_FILENO);
  close(null);
}

[[noreturn]] void run_child(int pipe_end, const ChildLimits& limits,
                            const std::function<void(const std::function<void(std::uint64_t)>&)>& work) {
  be_silent();
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const rlimit time{limits.seconds, limits.seconds + 1};
  setrlimit(RLIMIT_CPU, &time);
  const AllocationLimit memory(limits.bytes);
  try {
    work([pipe_end](std::uint64_t at) {
      if (write(pipe_end, &at, sizeof at) != static_cast<ssize_t>(sizeof at)) _exit(2);
    });
  } catch (const std::exception&) {
    _exit(3);
  }
  // Skips destructors and does not flush buffers of the parent.
  _exit(0);
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
  int ends[2];
  if (pipe(ends) != 0) return Error{std::string("no pipe to a child process: ") + std::strerror(errno)};
  const pid_t child = fork();
  if (child < 0) {
    close(ends[0]);
    close(ends[1]);
    return Error{std::string("no child process: ") + std::strerror(errno)};
  }
  if (child == 0) {
    close(ends[0]);
    run_child(ends[1], limits, work);
  }
  close(ends[1]);
  ChildEnd end;
  std::uint64_t at = 0;
  for (;;) {
    const ssize_t got = read(ends[0], &at, sizeof at);
    if (got == static_cast<ssize_t>(sizeof at)) {
      end.last = at;
    } else if (got >= 0 || errno != EINTR) {
      break;
    }
  }
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  end.completed = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  end.out_of_time = WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL);
  return end;
}

}  // namespace parhelion::pose
