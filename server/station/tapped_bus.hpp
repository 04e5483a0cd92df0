// The server's own endpoint of the bus, with a tap for the station. A second endpoint on the same machine
// would be woken by each scan together with the first one, and slow it down.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>

#include "protocols/bus/bus.hpp"

namespace parhelion::station {

/// The owner receives as from `network`. Messages that the tap subscribes to are copied while the owner
/// receives, so the tap gets messages only as long as the owner receives. The owner takes no lock that a
/// low-priority thread of the tap could hold (priority inversion), and wakes no thread: readers of the tap
/// poll 200 times a second.
class TappedBus : public Bus {
 public:
  /// `speaker`: endpoint on which the tap publishes, for the same reason.
  TappedBus(std::unique_ptr<Bus> network, std::unique_ptr<Bus> speaker);
  ~TappedBus() override;

  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override;
  /// Call in one thread.
  Result<bool> receive(Message& message, Duration timeout) override;
  Status subscribe(const std::string& pattern, int capacity) override;
  std::uint64_t dropped() const override;

  /// Call once; a SharedEndpoint makes many of it. May outlive this object, and then receives nothing. A
  /// message that matches two different patterns, of the owner or its own, arrives twice. Thread-safe.
  std::unique_ptr<Bus> tap();

 private:
  struct Shared;
  class Tap;
  struct Wanted {
    bool by_owner = false, by_tap = false;
  };
  Wanted wanted(const std::string& channel);

  const std::shared_ptr<Shared> shared_;
  // Used by the receiving thread.
  std::unordered_map<std::string, Wanted> wanted_;  ///< by channel received so far
  std::uint64_t version_ = 0;                       ///< of the patterns used for `wanted_`
};

}  // namespace parhelion::station
