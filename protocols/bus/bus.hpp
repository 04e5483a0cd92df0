// Transport: one small interface with network, memory and log-file implementations. Payloads are bytes;
// codec.hpp decodes them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/status.hpp"
#include "protocols/time.hpp"

namespace parhelion {

/// A message as sent or received.
struct Message {
  std::string channel;
  ArrivalTime
      arrival;  ///< log: the event's timestamp; network: microseconds of receipt, not yet strictly
                ///< increasing, and younger than that of a later message where only the newest is kept
  std::vector<std::uint8_t> payload;
  /// The same for all messages of one sender: its key where messages are signed, else its socket, whose
  /// address can be forged. 0: unknown, as in a log.
  std::uint64_t sender = 0;
};

class Bus {
 public:
  virtual ~Bus() = default;
  /// Sends; never blocks on a slow receiver. Any thread may send.
  virtual Status publish(std::string_view channel, std::span<const std::uint8_t> payload) = 0;
  /// Waits at most `timeout` for one message on the subscribed channels; false: none arrived. Messages
  /// dropped because a queue was full are counted in dropped().
  virtual Result<bool> receive(Message& message, Duration timeout) = 0;
  /// `pattern`: a channel, or a regular expression as in LCM. `capacity`: maximum number of queued messages;
  /// the oldest is dropped first.
  virtual Status subscribe(const std::string& pattern, int capacity) = 0;
  virtual std::uint64_t dropped() const = 0;
};

/// Other machines whose datagrams are received. Their addresses can be forged by anyone in the network.
struct OtherHosts {
  std::vector<std::string> addresses;  ///< IPv4, as 192.168.1.20
  /// Called once for each of the first hosts that are refused, in a thread of the bus. May be empty.
  std::function<void(const std::string& address)> refused;
};

/// LCM over the network; empty url: LCM_DEFAULT_URL, else udpm with ttl=0 and a receive buffer of 4 MiB. An
/// error names the missing multicast route and the command that adds it. `hosts` absent: all machines; with
/// ttl=0 only this one in any case.
Result<std::unique_ptr<Bus>> open_network_bus(const std::string& url, std::optional<OtherHosts> hosts = {});

/// Endpoints in one process that receive each other's messages; for tests. Thread-safe.
class MemoryBusHub {
 public:
  MemoryBusHub();
  ~MemoryBusHub();
  std::unique_ptr<Bus> connect();

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace parhelion
