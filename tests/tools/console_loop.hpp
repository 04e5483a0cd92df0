// A console and a server on one bus, with one clock.
#pragma once

#include <functional>
#include <memory>

#include "protocols/bus/bus.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::test {

/// `Drive` is a ScriptedDrive.
template <class Drive>
class ConsoleLoop : public Drive {
 protected:
  using Drive::configuration_, Drive::now_, Drive::observer_, Drive::outputs_, Drive::state_;

  virtual Status update_console() = 0;
  /// The server's latest outputs go to the bus.
  virtual void publish() {
    for (const tick::Outputs::Entry& entry : outputs_.entries())
      ASSERT_TRUE(server_->publish(entry.channel, entry.payload).ok());
  }

  void connect() {
    server_ = hub_.connect();
    bus_ = hub_.connect();
    for (const std::string& input : configuration_.channels.inputs())
      ASSERT_TRUE(server_->subscribe(input, 100).ok());
  }
  /// The server for `period` of the clock, then `act`, then the console, then the console's messages to the
  /// server.
  void step(
      Duration period, const std::function<void()>& act = [] {}) {
    now_ = now_ + period;
    outputs_.clear();
    tick::advance(configuration_, now_, *state_, outputs_, observer_);
    publish();
    act();
    const Status updated = update_console();
    EXPECT_TRUE(updated.ok()) << updated.error().message;
    Message input;
    for (auto received = server_->receive(input, Duration{0}); received.ok() && *received;
         received = server_->receive(input, Duration{0})) {
      input.arrival = now_ = now_ + microseconds(1);
      outputs_.clear();
      tick::tick(configuration_, input, *state_, outputs_, observer_);
      publish();
    }
  }

  MemoryBusHub hub_;
  std::unique_ptr<Bus> server_, bus_;
};

}  // namespace parhelion::test
