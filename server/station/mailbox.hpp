// Queue of the station's worker: messages of the bus and of pages.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <variant>

#include "protocols/bus/bus.hpp"
#include "server/station/http/web_client.hpp"

namespace parhelion::station {

struct ClientConnected {
  std::shared_ptr<WebClient> client;
};
struct ClientText {
  std::uint64_t client = 0;
  std::string text;
};
struct ClientDisconnected {
  std::uint64_t client = 0;
};
struct BusFailed {
  std::string why;
};
using StationEvent = std::variant<Message, ClientConnected, ClientText, ClientDisconnected, BusFailed>;

/// Thread-safe and bounded. When it is full, messages wait in the bus, where the newest of each channel wins.
class Mailbox {
 public:
  static constexpr std::size_t kMaxMessages = 64;  ///< of the bus
  static constexpr std::size_t kMaxTexts = 4096;   ///< of pages

  /// Blocks until there is room. False: closed.
  bool put(Message message);
  /// Never blocks. False: the queue is full.
  bool put(ClientText text);
  void put(ClientConnected opened) { push(StationEvent(std::move(opened))); }
  void put(ClientDisconnected closed) { push(StationEvent(closed)); }
  void put(BusFailed failed) { push(StationEvent(std::move(failed))); }
  /// False: nothing arrived within `timeout`, or closed.
  bool take(StationEvent& event, Duration timeout);
  void close();

 private:
  void push(StationEvent event);

  std::mutex mutex_;
  std::condition_variable came_, taken_;
  std::deque<StationEvent> events_;
  std::size_t messages_ = 0, texts_ = 0;
  bool closed_ = false;
};

}  // namespace parhelion::station
