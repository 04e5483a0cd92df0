// One endpoint of the bus for all parts of the station. The network copies each packet to each endpoint of a
// machine, on the sender's time: several of them would cost the scan path more than all that is done with it.
#pragma once

#include <memory>
#include <stop_token>
#include <thread>

#include "protocols/bus/bus.hpp"

namespace parhelion::station {

/// What comes is handed on in order, 200 times a second: whoever looks is not woken by the scan that the
/// server has just been woken to answer, and what pages are shown is up to 5 ms older. A bus that fails is
/// told to all who listen, and tried again. Thread-safe.
class SharedEndpoint {
 public:
  explicit SharedEndpoint(std::unique_ptr<Bus> bus);
  /// Endpoints may outlive it: they hear nothing any more, and still publish.
  ~SharedEndpoint();
  SharedEndpoint(const SharedEndpoint&) = delete;
  SharedEndpoint& operator=(const SharedEndpoint&) = delete;

  /// An endpoint that hears what it subscribes to. Patterns that overlap without being equal hear what is on
  /// both twice.
  std::unique_ptr<Bus> connect();

 private:
  struct Shared;
  class Endpoint;
  void hand_on(const std::stop_token& stop);

  std::shared_ptr<Shared> shared_;
  std::jthread thread_;
};

}  // namespace parhelion::station
