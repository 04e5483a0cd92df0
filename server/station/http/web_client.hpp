// One open WebSocket or picture stream, as seen by the code that sends to it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "server/station/http/identity.hpp"

namespace parhelion::station {

/// Origin of a client, fixed for its life.
struct WebClientOrigin {
  std::uint64_t id = 0;  ///< never reused by one server
  Identity who;          ///< empty name: not logged in (only on routes open to everyone)
  std::string remote;    ///< address of the peer
  std::string path, query;
};

/// Thread-safe. May outlive its connection and its server; then send() and close() do nothing.
class WebClient {
 public:
  explicit WebClient(WebClientOrigin origin) : origin_(std::move(origin)) {}
  virtual ~WebClient() = default;
  WebClient(const WebClient&) = delete;
  WebClient& operator=(const WebClient&) = delete;

  static constexpr int kInOrder = -1;
  /// Never blocks. `slot` kInOrder: every message, in order; a client with too much waiting
  /// (HttpOptions::waiting_bytes) is closed with 1013. `slot` >= 0: newest wins, the new message replaces a
  /// waiting one of the same slot in its place.
  virtual void send(std::shared_ptr<const std::string> bytes, bool binary, int slot = kInOrder) = 0;
  /// Bytes that the kernel has not accepted yet, including those of the message that is being written.
  virtual std::size_t waiting_bytes() const = 0;
  /// `code`: of RFC 6455, section 7.4, 1000 and above. Waiting messages are dropped.
  virtual void close(int code, std::string why) = 0;

  std::uint64_t id() const { return origin_.id; }
  const Identity& who() const { return origin_.who; }
  const std::string& remote() const { return origin_.remote; }
  const std::string& path() const { return origin_.path; }
  const std::string& query() const { return origin_.query; }

 private:
  WebClientOrigin origin_;
};

/// Called on the server's thread and must not block: opened, then received for each whole message, then
/// closed, exactly once and last. Text is valid UTF-8.
struct SocketHandler {
  std::function<void(std::shared_ptr<WebClient>)> opened = {};
  std::function<void(WebClient&, std::string_view bytes, bool binary)> received = {};
  std::function<void(WebClient&)> closed = {};
};

}  // namespace parhelion::station
