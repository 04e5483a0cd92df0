// One bus for the server's loop and for other readers of the same process. A second endpoint of the network
// would copy and wake for each scan, too, and slow the loop down.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "protocols/bus/bus.hpp"

namespace parhelion {

/// The owner receives as from `network`. While it does, it also fills the bounded queues of the readers, so
/// they get messages only as long as the owner receives. It wakes no reader: readers look 200 times a second.
/// Capacities hold for what `network` delivers: where it verifies signatures, a flood of unsigned messages
/// displaces no others.
class SharedBus : public Bus {
 public:
  /// `speaker`: the readers publish on it, so that they do not hold up what the owner publishes.
  SharedBus(std::unique_ptr<Bus> network, std::unique_ptr<Bus> speaker);
  ~SharedBus() override;
  SharedBus(const SharedBus&) = delete;
  SharedBus& operator=(const SharedBus&) = delete;

  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override;
  /// Call in one thread.
  Result<bool> receive(Message& message, Duration timeout) override;
  /// A message that matches several patterns of one reader arrives once; one that matches different patterns
  /// of several readers arrives once for each of these.
  Status subscribe(const std::string& pattern, int capacity) override;
  std::uint64_t dropped() const override;

  /// A further reader. May outlive this object, and then receives nothing and still publishes. Thread-safe.
  std::unique_ptr<Bus> connect();

 private:
  struct Shared;
  struct Inbox;
  class Reader;
  struct Target {
    std::shared_ptr<Inbox> inbox;
    std::size_t queue;
  };
  void deliver(const Message& message);
  const std::vector<Target>& targets(const std::string& channel);

  const std::shared_ptr<Shared> shared_;
  const std::shared_ptr<Inbox> own_;
  // Used by the receiving thread.
  Message received_;
  std::unordered_map<std::string, std::vector<Target>> targets_;  ///< by channel received so far
  std::uint64_t version_ = 0;                                     ///< of the patterns used for `targets_`
};

}  // namespace parhelion
