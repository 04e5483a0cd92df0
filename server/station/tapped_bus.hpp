// The server's own endpoint of the bus, at which the station listens in: a second endpoint of the same
// machine would be woken by each scan just when the first one is, and slow it down.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>

#include "protocols/bus/bus.hpp"

namespace parhelion::station {

/// Its owner receives as from `network`. What the tap subscribes to is copied for it as the owner receives:
/// it hears as long as the owner does. The owner waits for no lock that the tap's threads, of low priority,
/// could hold while others run in their place; nor does it wake anybody: whoever waits at the tap looks 200
/// times a second.
class TappedBus : public Bus {
 public:
  /// `speaker`: what the tap publishes on, for the same reason.
  TappedBus(std::unique_ptr<Bus> network, std::unique_ptr<Bus> speaker);
  ~TappedBus() override;

  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override;
  /// By one thread.
  Result<bool> receive(Message& message, Duration timeout) override;
  Status subscribe(const std::string& pattern, int capacity) override;
  std::uint64_t dropped() const override;

  /// Once; a SharedEndpoint makes many of it. May outlive this; then it hears nothing any more. Patterns that
  /// overlap without being equal, with the owner's or its own, hear twice. Thread-safe.
  std::unique_ptr<Bus> tap();

 private:
  struct Shared;
  class Tap;
  struct Wanted {
    bool by_owner = false, by_tap = false;
  };
  Wanted wanted(const std::string& channel);

  const std::shared_ptr<Shared> shared_;
  // Of the thread that receives.
  std::unordered_map<std::string, Wanted> wanted_;  ///< of channels that were heard
  std::uint64_t version_ = 0;                       ///< of the patterns that they were matched with
};

}  // namespace parhelion::station
