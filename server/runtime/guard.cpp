#include "server/runtime/guard.hpp"

#include <chrono>
#include <limits>

#include "server/runtime/wall_clock.hpp"

namespace parhelion::runtime {

Guard::Guard(Duration patience, Publish publish)
    : patience_(patience), publish_(std::move(publish)), thread_([this] { run(); }) {}

Guard::~Guard() {
  {
    const std::lock_guard lock(mutex_);
    send_before(std::numeric_limits<std::uint64_t>::max());
    stop_ = true;
  }
  stopped_.notify_all();
  thread_.join();
}

std::uint64_t Guard::watch(std::span<const std::uint8_t> raw_scan) {
  const std::lock_guard lock(mutex_);
  const std::uint64_t ticket = next_ticket_++;
  watched_.push_back({ticket, steady_now() + patience_, {raw_scan.begin(), raw_scan.end()}});
  return ticket;
}

bool Guard::answer(std::uint64_t ticket, std::span<const std::uint8_t> scan) {
  const std::lock_guard lock(mutex_);
  send_before(ticket);
  if (watched_.empty() || watched_.front().ticket != ticket) return false;
  watched_.pop_front();
  publish_(scan);
  return true;
}

void Guard::give_up(std::uint64_t ticket) {
  const std::lock_guard lock(mutex_);
  send_before(ticket + 1);
}

std::uint64_t Guard::fired() const {
  const std::lock_guard lock(mutex_);
  return fired_;
}

void Guard::send_oldest() {
  const Watched late = std::move(watched_.front());
  watched_.pop_front();
  ++fired_;
  publish_(late.raw_scan);
}

void Guard::send_before(std::uint64_t ticket) {
  while (!watched_.empty() && watched_.front().ticket < ticket) send_oldest();
}

/// Polls at least once per timeout instead of being notified: waking a thread would delay the loop's result.
void Guard::run() {
  std::unique_lock lock(mutex_);
  while (!stop_) {
    const Duration left = watched_.empty() ? patience_ : watched_.front().deadline - steady_now();
    if (left.ns > 0) {
      stopped_.wait_for(lock, std::chrono::nanoseconds(left.ns));
    } else {
      send_oldest();
    }
  }
}

}  // namespace parhelion::runtime
