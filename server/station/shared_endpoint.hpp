// One endpoint of the bus for all parts of the station. The network copies each packet to each endpoint of a
// machine, in the sender's time: several endpoints would slow down the scan path more than all their work.
#pragma once

#include <memory>
#include <stop_token>
#include <thread>

#include "protocols/bus/bus.hpp"

namespace parhelion::station {

/// Passes on messages in order, 200 times a second. Receivers are therefore not woken by the scan that has
/// just woken the server, and data shown on pages is up to 5 ms older. A failure of the bus is reported to
/// all receivers and retried. Thread-safe.
class SharedEndpoint {
 public:
  explicit SharedEndpoint(std::unique_ptr<Bus> bus);
  /// Endpoints may outlive it. They then receive nothing, and still publish.
  ~SharedEndpoint();
  SharedEndpoint(const SharedEndpoint&) = delete;
  SharedEndpoint& operator=(const SharedEndpoint&) = delete;

  /// An endpoint with its own subscriptions. A message that matches two different patterns arrives twice.
  std::unique_ptr<Bus> connect();

 private:
  struct Shared;
  class Endpoint;
  void hand_on(const std::stop_token& stop);

  std::shared_ptr<Shared> shared_;
  std::jthread thread_;
};

}  // namespace parhelion::station
