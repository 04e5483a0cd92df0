// Queue of the station's worker: what pages do.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <variant>

#include "protocols/time.hpp"
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
using ClientEvent = std::variant<ClientConnected, ClientText, ClientDisconnected>;

/// Thread-safe; its texts are bounded.
class ClientEvents {
 public:
  static constexpr std::size_t kMaxTexts = 4096;

  /// False: the queue is full.
  bool put(ClientText text);
  void put(ClientConnected opened) { push(std::move(opened)); }
  void put(ClientDisconnected closed) { push(closed); }
  /// False: nothing was put within `timeout`.
  bool take(ClientEvent& event, Duration timeout);

 private:
  void push(ClientEvent event);

  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<ClientEvent> events_;
  std::size_t texts_ = 0;
};

}  // namespace parhelion::station
