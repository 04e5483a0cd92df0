#include "server/runtime/refused_messages.hpp"

#include <utility>

namespace parhelion::runtime {

namespace {

/// A stranger can invent channels of agents without end: they are one.
std::string_view reported(std::string_view channel) {
  return channel.starts_with("MR_AGENT_") ? "MR_AGENT_*" : channel;
}

}  // namespace

void RefusedMessages::add(const RefusedMessage& message) {
  const std::string channel(reported(message.channel));
  const std::lock_guard lock(mutex_);
  ++count_;
  if (known_.size() >= kMaxKinds || !known_.emplace(message.fault, channel).second) return;
  news_.push_back({message.fault, channel, std::string(message.sender)});
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
