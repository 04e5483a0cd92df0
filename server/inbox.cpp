#include "server/inbox.hpp"

#include <algorithm>
#include <chrono>

namespace parhelion {
namespace {

constexpr Duration poll = milliseconds(50);  // how soon the thread notices that it is to end

bool may_be_dropped(InputKind kind) {
  return kind == InputKind::camera || kind == InputKind::depth || kind == InputKind::odometry ||
         kind == InputKind::pose_cov || kind == InputKind::none;
}

}  // namespace

Inbox::Inbox(Bus& bus, const ChannelMap& channels, Guard& guard)
    : bus_(bus), channels_(channels), guard_(guard), thread_([this] { run(); }) {}

Inbox::~Inbox() {
  stop_ = true;
  thread_.join();
}

void Inbox::run() {
  while (!stop_) {
    Message message;
    auto received = bus_.receive(message, poll);
    if (!received) {
      const std::lock_guard lock(mutex_);
      fault_ = received.error().message;
      changed_.notify_all();
      return;
    }
    if (*received) push(std::move(message));
  }
}

void Inbox::push(Message message) {
  Arrived arrived;
  arrived.received = steady_now();
  const InputKind kind = channels_.kind(message.channel);
  if (kind == InputKind::none) return;
  if (kind == InputKind::scan) arrived.ticket = guard_.watch(message.payload);
  arrived.message = std::move(message);
  const std::lock_guard lock(mutex_);
  if (queue_.size() >= capacity) {
    ++dropped_;
    const auto oldest = std::find_if(queue_.begin(), queue_.end(), [this](const Arrived& waiting) {
      return may_be_dropped(channels_.kind(waiting.message.channel));
    });
    queue_.erase(oldest != queue_.end() ? oldest : queue_.begin());
  }
  queue_.push_back(std::move(arrived));
  changed_.notify_all();
}

std::optional<Arrived> Inbox::take(WallTime deadline) {
  std::unique_lock lock(mutex_);
  while (queue_.empty()) {
    const Duration left = deadline - steady_now();
    if (left.ns <= 0 || !fault_.empty()) return std::nullopt;
    changed_.wait_for(lock, std::chrono::nanoseconds(left.ns));
  }
  Arrived arrived = std::move(queue_.front());
  queue_.pop_front();
  lock.unlock();
  arrived.message.arrival = stamp();
  return arrived;
}

ArrivalTime Inbox::now() const { return ArrivalTime{wall_start_.ns} + (steady_now() - steady_start_); }

ArrivalTime Inbox::stamp() {
  // Microseconds, as a log keeps them.
  last_ = std::max(ArrivalTime::from_utime(now().utime()), last_ + microseconds(1));
  return last_;
}

std::uint64_t Inbox::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_ + bus_.dropped();
}

std::string Inbox::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

}  // namespace parhelion
