// Messages from one thread to another of which neither waits for the other.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "protocols/bus/bus.hpp"

namespace parhelion::station {

/// put() and take_all() may run at the same time, each by one thread at a time; neither holds a lock, and
/// what take_all() is through with, put() uses again. Lists that are taken whole (R. K. Treiber, Systems
/// Programming: Coping with Parallelism, IBM RJ 5118, 1986), so that no node can come back meanwhile.
class HandedMessages {
 public:
  HandedMessages() = default;
  ~HandedMessages() {
    for (std::atomic<Node*>* list : {&handed_, &used_}) destroy(list->load());
    destroy(spare_);
  }
  HandedMessages(const HandedMessages&) = delete;
  HandedMessages& operator=(const HandedMessages&) = delete;

  /// A copy. Where nobody has taken anything for long, it is dropped, and counted.
  void put(const Message& message) {
    const std::size_t size = message.payload.size() + overhead;
    if (bytes_.load(std::memory_order_relaxed) + size > most_bytes) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    bytes_.fetch_add(size, std::memory_order_relaxed);
    if (spare_ == nullptr) spare_ = used_.exchange(nullptr, std::memory_order_acquire);
    if (spare_ != nullptr) kept_.fetch_sub(1, std::memory_order_relaxed);
    Node* node = spare_ == nullptr ? new Node : std::exchange(spare_, spare_->next);
    node->message = message;  // into the capacity that it has
    push(handed_, node);
  }

  /// Calls `take(const Message&)` with all that was put since, in order.
  template <class Take>
  void take_all(Take&& take) {
    Node* oldest = nullptr;
    for (Node* node = handed_.exchange(nullptr, std::memory_order_acquire); node != nullptr;)
      oldest = std::exchange(node, std::exchange(node->next, oldest));
    while (oldest != nullptr) {
      Node* node = std::exchange(oldest, oldest->next);
      take(std::as_const(node->message));
      const std::size_t size = node->message.payload.size() + overhead;
      // What a burst or a picture took is given back.
      if (size > longest_kept || kept_.load(std::memory_order_relaxed) >= most_kept) {
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
  static constexpr std::size_t overhead = 128;                         // of a message without payload
  static constexpr std::size_t most_bytes = std::size_t{64} << 20U;    // waiting
  static constexpr std::size_t longest_kept = std::size_t{16} << 10U;  // bytes of a node to be used again
  static constexpr std::size_t most_kept = 64;                         // such nodes

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
  Node* spare_ = nullptr;  // of the thread that puts
};

}  // namespace parhelion::station
