// The Foxglove WebSocket protocol (subprotocols foxglove.sdk.v1 and foxglove.websocket.v1): Foxglove and
// Lichtblick open the session on the bus. https://github.com/foxglove/ws-protocol, version 1.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::station {

struct FoxgloveOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 8765;  ///< 0: any free port
  std::string name = "Parhelion";
  /// Pages of other sites that may read the session; Foxglove's own web app.
  std::vector<std::string> origins = {"https://app.foxglove.dev"};
  /// The session's time for clients; may jump back in a recording. None: this machine's clock.
  std::function<ArrivalTime()> clock;
};

/// Read-only: accepts no commands and requires no log-in. Its own thread reads the bus.
class FoxgloveServer {
 public:
  /// `configuration`: of the running session; MR_SESSION on the bus starts another one. Error: the address
  /// cannot be used, or the bus cannot be subscribed to.
  static Result<std::unique_ptr<FoxgloveServer>> open(std::unique_ptr<Bus> bus,
                                                      const tick::Configuration& configuration,
                                                      const FoxgloveOptions& options);
  ~FoxgloveServer();
  FoxgloveServer(const FoxgloveServer&) = delete;
  FoxgloveServer& operator=(const FoxgloveServer&) = delete;

  std::uint16_t port() const;
  /// "ws://127.0.0.1:8765": the address to enter in Foxglove.
  std::string address() const;

 private:
  struct Running;
  explicit FoxgloveServer(std::unique_ptr<Running> running);
  std::unique_ptr<Running> running_;
};

}  // namespace parhelion::station
