// A lock-free queue of messages from one thread to another.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "protocols/bus/bus.hpp"

namespace parhelion::station {

/// put() and take_all() may run at the same time, each in one thread at a time, without locks. put() reuses
/// the nodes that take_all() has finished with. Lists are taken whole (R. K. Treiber, Systems Programming:
/// Coping with Parallelism, IBM RJ 5118, 1986), which rules out the ABA problem.
class HandedMessages {
 public:
  HandedMessages() = default;
  ~HandedMessages() {
    for (std::atomic<Node*>* list : {&handed_, &used_}) destroy(list->load());
    destroy(spare_);
  }
  HandedMessages(const HandedMessages&) = delete;
  HandedMessages& operator=(const HandedMessages&) = delete;

  /// Copies the message. If too much waits in the queue, it is dropped and counted.
  void put(const Message& message) {
    const std::size_t size = message.payload.size() + kOverhead;
    if (bytes_.load(std::memory_order_relaxed) + size > kMaxBytes) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    bytes_.fetch_add(size, std::memory_order_relaxed);
    if (spare_ == nullptr) spare_ = used_.exchange(nullptr, std::memory_order_acquire);
    if (spare_ != nullptr) kept_.fetch_sub(1, std::memory_order_relaxed);
    Node* node = spare_ == nullptr ? new Node : std::exchange(spare_, spare_->next);
    node->message = message;  // reuses the node's capacity
    push(handed_, node);
  }

  /// Calls `take(const Message&)` for all messages put since the last call, in order.
  template <class Take>
  void take_all(Take&& take) {
    Node* oldest = nullptr;
    for (Node* node = handed_.exchange(nullptr, std::memory_order_acquire); node != nullptr;)
      oldest = std::exchange(node, std::exchange(node->next, oldest));
    while (oldest != nullptr) {
      Node* node = std::exchange(oldest, oldest->next);
      take(std::as_const(node->message));
      const std::size_t size = node->message.payload.size() + kOverhead;
      // Memory for bursts and images is freed.
      if (size > kLongestKept || kept_.load(std::memory_order_relaxed) >= kMaxKept) {
        delete node;
      } else {
        kept_.fetch_add(1, std::memory_order_relaxed);
        push(used_, node);
      }
      bytes_.fetch_sub(size, std::memory_order_relaxed);
    }
  }

  std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::size_t kOverhead = 128;                        // of a message without payload
  static constexpr std::size_t kMaxBytes = std::size_t{64} << 20U;     // maximum in the queue
  static constexpr std::size_t kLongestKept = std::size_t{16} << 10U;  // bytes; larger nodes are not reused
  static constexpr std::size_t kMaxKept = 64;                          // number of reusable nodes

  struct Node {
    Message message;
    Node* next = nullptr;
  };

  static void push(std::atomic<Node*>& list, Node* node) {
    node->next = list.load(std::memory_order_relaxed);
    while (
        !list.compare_exchange_weak(node->next, node, std::memory_order_release, std::memory_order_relaxed)) {
    }
  }
  static void destroy(Node* node) {
    while (node != nullptr) delete std::exchange(node, node->next);
  }

  std::atomic<Node*> handed_{nullptr}, used_{nullptr};
  std::atomic<std::size_t> bytes_{0}, kept_{0};
  std::atomic<std::uint64_t> dropped_{0};
  Node* spare_ = nullptr;  // used by the producer thread
};

}  // namespace parhelion::station
