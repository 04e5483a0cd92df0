#include "server/station/http/client_queue.hpp"

#include <algorithm>

namespace parhelion::station {

ClientQueue::ClientQueue(WebClientOrigin origin, std::size_t limit, std::function<void()> wake)
    : WebClient(std::move(origin)), limit_(limit), wake_(std::move(wake)) {}

void ClientQueue::send(std::shared_ptr<const std::string> bytes, bool binary, int slot) {
  const std::lock_guard lock(mutex_);
  if (shut_) return;
  const std::size_t size = bytes->size();
  if (slot < 0) {
    if (in_order_ + size + kOverhead > limit_) {
      request_close(1013, "reads too slowly: " + std::to_string(in_order_) + " bytes wait");
      return;
    }
    in_order_ += size + kOverhead;
  } else if (const auto old = std::find_if(messages_.begin(), messages_.end(),
                                           [slot](const Message& m) { return m.slot == slot; });
             old != messages_.end()) {
    waiting_ = waiting_ - old->bytes->size() + size;
    *old = {std::move(bytes), binary, slot};
    ++replaced_;
    return;
  }
  waiting_ += size;
  messages_.push_back({std::move(bytes), binary, std::max(slot, kInOrder)});
  wake();
}

std::size_t ClientQueue::waiting_bytes() const {
  const std::lock_guard lock(mutex_);
  return waiting_ + writing_;
}

void ClientQueue::close(int code, std::string why) {
  const std::lock_guard lock(mutex_);
  request_close(code, std::move(why));
}

ClientQueue::Next ClientQueue::take() {
  const std::lock_guard lock(mutex_);
  writing_ = 0;
  Next next;
  if (closing_) {
    next.closing = std::move(closing_);
    closing_.reset();
  } else if (!messages_.empty()) {
    next.message = std::move(messages_.front());
    messages_.pop_front();
    writing_ = next.message->bytes->size();
    waiting_ -= writing_;
    if (next.message->slot < 0) in_order_ -= writing_ + kOverhead;
  }
  awake_ = next.message || next.closing;
  return next;
}

void ClientQueue::end() {
  const std::lock_guard lock(mutex_);
  shut_ = true;
  wake_ = nullptr;
  closing_.reset();
  messages_.clear();
  waiting_ = in_order_ = writing_ = 0;
}

std::uint64_t ClientQueue::replaced() const {
  const std::lock_guard lock(mutex_);
  return replaced_;
}

void ClientQueue::request_close(int code, std::string why) {
  if (shut_) return;
  shut_ = true;
  messages_.clear();
  waiting_ = in_order_ = 0;
  closing_ = Closing{code, std::move(why)};
  wake();
}

void ClientQueue::wake() {
  if (awake_ || !wake_) return;
  awake_ = true;
  wake_();
}

}  // namespace parhelion::station
