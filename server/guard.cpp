#include "server/guard.hpp"

#include <chrono>
#include <span>

#include "server/wall_clock.hpp"

namespace parhelion {

Guard::Guard(Duration patience, Publish publish_raw)
    : patience_(patience), publish_raw_(std::move(publish_raw)), thread_([this] { run(); }) {}

Guard::~Guard() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::uint64_t Guard::watch(std::span<const std::uint8_t> raw_scan) {
  const std::lock_guard lock(mutex_);
  const std::uint64_t ticket = next_ticket_++;
  watched_.push_back({ticket, steady_now() + patience_, {raw_scan.begin(), raw_scan.end()}, false});
  changed_.notify_all();
  return ticket;
}

bool Guard::claim(std::uint64_t ticket) {
  const std::lock_guard lock(mutex_);
  for (Watched& scan : watched_) {
    if (scan.ticket != ticket) continue;
    const bool mine = !scan.claimed;
    scan.claimed = true;
    return mine;
  }
  return false;  // no longer watched: the guard has answered it
}

std::uint64_t Guard::fired() const {
  const std::lock_guard lock(mutex_);
  return fired_;
}

void Guard::run() {
  std::unique_lock lock(mutex_);
  while (!stop_) {
    while (!watched_.empty() && watched_.front().claimed) watched_.pop_front();
    if (watched_.empty()) {
      changed_.wait(lock);
      continue;
    }
    const Duration left = watched_.front().deadline - steady_now();
    if (left.ns > 0) {
      changed_.wait_for(lock, std::chrono::nanoseconds(left.ns));
      continue;
    }
    const Watched late = std::move(watched_.front());
    watched_.pop_front();
    ++fired_;
    lock.unlock();
    publish_raw_(late.raw_scan);
    lock.lock();
  }
}

}  // namespace parhelion
