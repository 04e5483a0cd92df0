// The server's own endpoint of the bus, at which the station listens in: a second endpoint of the same
// machine would be woken by each scan just when the first one is, and slow it down.
#pragma once

#include <memory>

#include "protocols/bus/bus.hpp"

namespace parhelion {

/// Its owner receives as from `network`. What the taps subscribe to is copied for them as the owner receives:
/// they hear as long as it does, and nobody is woken for it who does not wait.
class TappedBus : public Bus {
 public:
  /// `speaker`: what the taps publish on. Of their own, so that a thread of low priority never holds a lock
  /// that the owner needs to send.
  TappedBus(std::unique_ptr<Bus> network, std::unique_ptr<Bus> speaker);
  ~TappedBus() override;

  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override;
  Result<bool> receive(Message& message, Duration timeout) override;
  Status subscribe(const std::string& pattern, int capacity) override;
  std::uint64_t dropped() const override;

  /// May outlive this; then it hears nothing any more. Patterns that overlap without being equal, with the
  /// owner's or others', hear twice.
  std::unique_ptr<Bus> tap();

 private:
  struct Shared;
  class Tap;
  std::shared_ptr<Shared> shared_;
};

}  // namespace parhelion
