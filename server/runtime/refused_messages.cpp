#include "server/runtime/refused_messages.hpp"

namespace parhelion::runtime {

void RefusedMessages::add(const RefusedMessage& message) {
  const std::lock_guard lock(mutex_);
  ++count_;
  if (known_.size() >= kMaxKinds) return;
  if (!known_.emplace(message.fault, message.channel).second) return;
  news_.push_back({message.fault, std::string(message.channel), std::string(message.sender)});
}

std::vector<RefusedMessages::First> RefusedMessages::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(news_, {});
}

std::uint64_t RefusedMessages::count() const {
  const std::lock_guard lock(mutex_);
  return count_;
}

}  // namespace parhelion::runtime
