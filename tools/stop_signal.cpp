#include "tools/stop_signal.hpp"

#include <atomic>
#include <chrono>
#include <csignal>

namespace parhelion::tools {
namespace {

using Clock = std::chrono::steady_clock;
static_assert(std::atomic<Clock::rep>::is_always_lock_free);

// A shell, timeout(1) and a parent that forwards signals signal both the process and its group: this counts
// once.
constexpr Clock::duration kSameRequest = std::chrono::milliseconds(500);

std::atomic<Clock::rep> asked_at = 0;  // 0: no request

void on_signal(int signal) {
  const Clock::rep now = Clock::now().time_since_epoch().count();
  Clock::rep first = 0;
  if (asked_at.compare_exchange_strong(first, now) || now - first < kSameRequest.count()) return;
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

}  // namespace

void catch_stop_signals() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
}

bool stop_asked() { return asked_at != 0; }

}  // namespace parhelion::tools
