// Bounded queues of one endpoint, one per subscription: a full queue drops its oldest message and counts it.
// All queues together hold a limited number of bytes; the one that holds most of them loses its messages. A
// queue for the newest message alone keeps its turn when that is replaced: else it would always be the
// youngest where more comes than is read, and never be read.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "protocols/bus/bus.hpp"

namespace parhelion {

class SubscriptionQueues {
 public:
  /// Index of a new queue.
  std::size_t add(int capacity) {
    queues_.push_back({static_cast<std::size_t>(capacity), {}});
    return queues_.size() - 1;
  }

  void push(std::size_t queue, std::string_view channel, ArrivalTime arrival,
            std::span<const std::uint8_t> payload, std::uint64_t sender = 0) {
    Queue& into = queues_[queue];
    std::optional<std::uint64_t> turn;
    if (into.waiting.size() == into.capacity) {
      if (into.capacity == 1) turn = into.waiting.front().number;
      drop_oldest(into);
    }
    while (bytes_ + payload.size() > kMaxBytes) {
      Queue& largest = *std::max_element(queues_.begin(), queues_.end(),
                                         [](const Queue& a, const Queue& b) { return a.bytes < b.bytes; });
      Queue& loser = largest.bytes > into.bytes + payload.size() ? largest : into;
      if (loser.waiting.empty()) {
        ++dropped_;
        return;
      }
      drop_oldest(loser);
    }
    into.bytes += payload.size();
    bytes_ += payload.size();
    Message message = reuse();
    message.channel.assign(channel);
    message.arrival = arrival;
    message.payload.assign(payload.begin(), payload.end());
    message.sender = sender;
    const std::uint64_t number = next_number_++;
    into.waiting.push_back({turn.value_or(number), std::move(message)});
  }

  /// The oldest message of all queues, but for the turn of the newest alone; its buffers are swapped with
  /// those of `message`, which are reused.
  bool pop(Message& message) {
    Queue* first = nullptr;
    for (Queue& queue : queues_) {
      if (queue.waiting.empty()) continue;
      if (first == nullptr || queue.waiting.front().number < first->waiting.front().number) first = &queue;
    }
    if (first == nullptr) return false;
    const std::size_t size = first->waiting.front().message.payload.size();
    first->bytes -= size;
    bytes_ -= size;
    std::swap(message, first->waiting.front().message);
    keep_spare(std::move(first->waiting.front().message));
    first->waiting.pop_front();
    return true;
  }

  bool empty() const {
    return std::all_of(queues_.begin(), queues_.end(),
                       [](const Queue& queue) { return queue.waiting.empty(); });
  }
  std::uint64_t dropped() const { return dropped_; }
  void count_dropped(std::uint64_t n) { dropped_ += n; }

 private:
  static constexpr std::size_t kMaxSpare = 64;
  static constexpr std::size_t kMaxSpareBytes = std::size_t{4} << 20;
  static constexpr std::size_t kMaxBytes = std::size_t{24} << 20;  // of all payloads
  struct Waiting {
    std::uint64_t number;
    Message message;
  };
  struct Queue {
    std::size_t capacity;
    std::deque<Waiting> waiting;
    std::size_t bytes = 0;  // of its payloads
  };

  void drop_oldest(Queue& queue) {
    const std::size_t size = queue.waiting.front().message.payload.size();
    queue.bytes -= size;
    bytes_ -= size;
    keep_spare(std::move(queue.waiting.front().message));
    queue.waiting.pop_front();
    ++dropped_;
  }

  Message reuse() {
    if (spare_.empty()) return {};
    Message message = std::move(spare_.back());
    spare_.pop_back();
    spare_bytes_ -= message.payload.capacity();
    return message;
  }

  /// The memory of large messages is freed.
  void keep_spare(Message&& message) {
    if (spare_.size() >= kMaxSpare || spare_bytes_ + message.payload.capacity() > kMaxSpareBytes) return;
    spare_bytes_ += message.payload.capacity();
    spare_.push_back(std::move(message));
  }

  std::vector<Queue> queues_;
  std::vector<Message> spare_;
  std::size_t bytes_ = 0, spare_bytes_ = 0;
  std::uint64_t next_number_ = 0;
  std::uint64_t dropped_ = 0;
};

/// Channel length 1..63 as in LCM, and a payload that fits its int32.
Status check_message(std::string_view channel, std::size_t payload_size);

/// Capacity of a subscription at least 1.
Status check_capacity(const std::string& pattern, int capacity);

}  // namespace parhelion
