#include "server/station/client_events.hpp"

#include <chrono>
#include <utility>

namespace parhelion::station {

bool ClientEvents::put(ClientText text) {
  const std::lock_guard lock(mutex_);
  if (texts_ >= kMaxTexts) return false;
  ++texts_;
  events_.emplace_back(std::move(text));
  came_.notify_one();
  return true;
}

void ClientEvents::push(ClientEvent event) {
  const std::lock_guard lock(mutex_);
  events_.push_back(std::move(event));
  came_.notify_one();
}

bool ClientEvents::take(ClientEvent& event, Duration timeout) {
  std::unique_lock lock(mutex_);
  if (!came_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [&] { return !events_.empty(); }))
    return false;
  event = std::move(events_.front());
  events_.pop_front();
  if (std::holds_alternative<ClientText>(event)) --texts_;
  return true;
}

}  // namespace parhelion::station
