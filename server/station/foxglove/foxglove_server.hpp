// The Foxglove WebSocket protocol (subprotocols foxglove.sdk.v1 and foxglove.websocket.v1): Foxglove and
// Lichtblick open the session that is on the bus. https://github.com/foxglove/ws-protocol, version 1.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "protocols/bus/bus.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::station {

struct FoxgloveOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 8765;  ///< 0: any that is free
  std::string name = "Parhelion";
  /// The session's time, which clients are told; may go back, as a recording's. None: this machine's.
  std::function<ArrivalTime()> clock;
};

/// Shows, and takes no commands; asks nobody who they are. A thread of its own reads the bus.
class FoxgloveServer {
 public:
  /// `configuration`: of the session that runs; MR_SESSION on the bus begins another. Error: the address
  /// cannot be used, or the bus not be listened to.
  static Result<std::unique_ptr<FoxgloveServer>> open(std::unique_ptr<Bus> bus,
                                                      const tick::Configuration& configuration,
                                                      const FoxgloveOptions& options);
  ~FoxgloveServer();
  FoxgloveServer(const FoxgloveServer&) = delete;
  FoxgloveServer& operator=(const FoxgloveServer&) = delete;

  std::uint16_t port() const;
  /// "ws://127.0.0.1:8765": what to type in Foxglove.
  std::string address() const;

 private:
  struct Running;
  explicit FoxgloveServer(std::unique_ptr<Running> running);
  std::unique_ptr<Running> running_;
};

}  // namespace parhelion::station
