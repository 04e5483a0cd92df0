#include "tools/play/play_thread.hpp"

#include <chrono>
#include <utility>

#include "server/runtime/wall_clock.hpp"

namespace parhelion::tools {

void PlayThread::start() {
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

PlayThread::~PlayThread() {
  thread_.request_stop();
  wake();
}

void PlayThread::wake() {
  const std::lock_guard lock(mutex_);
  awake_ = true;
  woken_.notify_all();
}

std::string PlayThread::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

void PlayThread::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const auto idle = player_.turn(runtime::steady_now());
    std::unique_lock lock(mutex_);
    if (!idle) {
      fault_ = idle.error().message;
      return;
    }
    woken_.wait_for(lock, stop, std::chrono::nanoseconds(idle->ns), [this] { return awake_; });
    awake_ = false;
  }
}

}  // namespace parhelion::tools
