#include "server/station/mailbox.hpp"

#include <chrono>
#include <utility>

namespace parhelion::station {

bool Mailbox::put(Message message) {
  std::unique_lock lock(mutex_);
  taken_.wait(lock, [&] { return closed_ || messages_ < most_messages; });
  if (closed_) return false;
  ++messages_;
  letters_.emplace_back(std::move(message));
  came_.notify_one();
  return true;
}

bool Mailbox::put(PageSaid text) {
  const std::lock_guard lock(mutex_);
  if (texts_ >= most_texts) return false;
  ++texts_;
  letters_.emplace_back(std::move(text));
  came_.notify_one();
  return true;
}

void Mailbox::push(Letter letter) {
  const std::lock_guard lock(mutex_);
  letters_.push_back(std::move(letter));
  came_.notify_one();
}

bool Mailbox::take(Letter& letter, Duration timeout) {
  std::unique_lock lock(mutex_);
  came_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [&] { return closed_ || !letters_.empty(); });
  if (letters_.empty() || closed_) return false;
  letter = std::move(letters_.front());
  letters_.pop_front();
  if (std::holds_alternative<Message>(letter)) {
    --messages_;
    taken_.notify_one();
  }
  if (std::holds_alternative<PageSaid>(letter)) --texts_;
  return true;
}

void Mailbox::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  came_.notify_all();
  taken_.notify_all();
}

}  // namespace parhelion::station
