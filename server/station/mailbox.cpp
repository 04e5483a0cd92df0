#include "server/station/mailbox.hpp"

#include <chrono>
#include <utility>

namespace parhelion::station {

bool Mailbox::put(Message message) {
  std::unique_lock lock(mutex_);
  taken_.wait(lock, [&] { return closed_ || messages_ < kMaxMessages; });
  if (closed_) return false;
  ++messages_;
  events_.emplace_back(std::move(message));
  came_.notify_one();
  return true;
}

bool Mailbox::put(ClientText text) {
  const std::lock_guard lock(mutex_);
  if (texts_ >= kMaxTexts) return false;
  ++texts_;
  events_.emplace_back(std::move(text));
  came_.notify_one();
  return true;
}

void Mailbox::push(StationEvent event) {
  const std::lock_guard lock(mutex_);
  events_.push_back(std::move(event));
  came_.notify_one();
}

bool Mailbox::take(StationEvent& event, Duration timeout) {
  std::unique_lock lock(mutex_);
  came_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [&] { return closed_ || !events_.empty(); });
  if (events_.empty() || closed_) return false;
  event = std::move(events_.front());
  events_.pop_front();
  if (std::holds_alternative<Message>(event)) {
    --messages_;
    taken_.notify_one();
  }
  if (std::holds_alternative<ClientText>(event)) --texts_;
  return true;
}

void Mailbox::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  came_.notify_all();
  taken_.notify_all();
}

}  // namespace parhelion::station
