// A client that sends arbitrary bytes over loopback.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace parhelion::test {

struct RawAnswer {
  int status = 0;                              ///< 0: the server closed without a response
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::string body;
};

/// Timeout for expected data; exceeding it is a failure.
constexpr int kPatienceMs = 20'000;

/// A port that was free a moment ago, for a server that must be found again after a restart.
inline std::uint16_t free_port() {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof own;
  EXPECT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&own), size), 0);
  EXPECT_EQ(::getsockname(socket, reinterpret_cast<sockaddr*>(&own), &size), 0);
  ::close(socket);
  return ntohs(own.sin_port);
}

class RawClient {
 public:
  /// `from`: this machine's address to connect from; null: 127.0.0.1. `suites`: those of TLS 1.2 that it
  /// offers, and no other version; null: what OpenSSL does.
  explicit RawClient(std::uint16_t port, bool encrypted = false, const char* from = nullptr,
                     const char* suites = nullptr) {
    socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (from) bind_to(from);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
    host_ = "127.0.0.1:" + std::to_string(port);
    origin_ = (encrypted ? "https://" : "http://") + host_;
    if (encrypted && connected_) shake_hands(suites);
  }
  ~RawClient() {
    if (tls_) SSL_free(tls_);
    if (context_) SSL_CTX_free(context_);
    ::close(socket_);
  }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  bool connected() const { return connected_; }
  const std::string& host() const { return host_; }
  const std::string& origin() const { return origin_; }
  int descriptor() const { return socket_; }

  /// False: the server has closed.
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = tls_ ? SSL_write(tls_, bytes.data(), static_cast<int>(bytes.size()))
                                : ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }

  /// Reads until the server closes.
  std::string rest() {
    while (read_more()) {
    }
    return std::exchange(buffer_, "");
  }
  std::optional<std::string> take(std::size_t size) {
    while (buffer_.size() < size) {
      if (!read_more()) return std::nullopt;
    }
    std::string taken = buffer_.substr(0, size);
    buffer_.erase(0, size);
    return taken;
  }

  RawAnswer answer(bool head_only = false) {
    RawAnswer answer;
    std::size_t end = 0;
    while ((end = buffer_.find("\r\n\r\n")) == std::string::npos) {
      if (!read_more()) return answer;
    }
    const std::string head = buffer_.substr(0, end + 2);
    buffer_.erase(0, end + 4);
    answer.status = std::stoi(head.substr(9, 3));
    for (std::size_t at = head.find("\r\n") + 2; at < head.size();) {
      const std::size_t line_end = head.find("\r\n", at), colon = head.find(':', at);
      std::string name = head.substr(at, colon - at);
      std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
      answer.headers[name] = head.substr(colon + 2, line_end - colon - 2);
      at = line_end + 2;
    }
    if (!head_only && answer.headers.contains("content-length")) {
      answer.body = take(std::stoul(answer.headers["content-length"])).value_or("(cut off)");
    }
    return answer;
  }

  RawAnswer get(const std::string& target, const std::string& cookie = "", const std::string& more = "") {
    send("GET " + target + " HTTP/1.1\r\nHost: " + host_ + "\r\n" + cookie_line(cookie) + more + "\r\n");
    return answer();
  }
  RawAnswer post(const std::string& target, const std::string& body, const std::string& cookie = "") {
    return post_from(origin_, target, body, cookie);
  }
  /// `origin` empty: without that header.
  RawAnswer post_from(const std::string& origin, const std::string& target, const std::string& body,
                      const std::string& cookie = "", const std::string& method = "POST") {
    send_post_from(origin, target, body, cookie, method);
    return answer();
  }
  /// Without waiting for the answer. False: the server has closed.
  bool send_post(const std::string& target, const std::string& body) {
    return send_post_from(origin_, target, body);
  }

  /// Status 101: the socket is open.
  RawAnswer open_socket(const std::string& target, const std::string& cookie = "",
                        const std::string& more = "") {
    return open_socket_from(origin_, target, cookie, more);
  }
  RawAnswer open_socket_from(const std::string& origin, const std::string& target,
                             const std::string& cookie = "", const std::string& more = "") {
    send("GET " + target + " HTTP/1.1\r\nHost: " + host_ + "\r\nOrigin: " + origin + "\r\n" +
         cookie_line(cookie) +
         "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
         more + "\r\n");
    return answer();
  }

  struct Frame {
    int opcode = 0;  ///< 1 text, 2 binary, 8 close
    std::string payload;
    /// Of a closing frame; 0: none.
    int code() const {
      return payload.size() < 2
                 ? 0
                 : static_cast<unsigned char>(payload[0]) * 256 + static_cast<unsigned char>(payload[1]);
    }
  };
  /// `size`: claimed by the header; default: the payload's own size.
  bool send_frame(int first_byte, std::string_view payload, std::optional<std::uint64_t> size = {},
                  bool masked = true) {
    const std::uint64_t claimed = size.value_or(payload.size());
    const int mask_bit = masked ? 0x80 : 0;
    std::string frame(1, static_cast<char>(first_byte));
    if (claimed < 126) {
      frame += static_cast<char>(mask_bit | static_cast<int>(claimed));
    } else {
      frame += static_cast<char>(mask_bit | (claimed < 65536 ? 126 : 127));
      for (int i = (claimed < 65536 ? 1 : 7); i >= 0; --i) frame += static_cast<char>(claimed >> (8 * i));
    }
    if (masked) frame += std::string(4, '\0');  // a mask of zeros leaves the bytes unchanged
    return send(frame + std::string(payload));
  }
  bool send_text(std::string_view text) { return send_frame(0x81, text); }
  /// nullopt: the server closed the connection, or sent only pings for kPatienceMs. Replies to pings.
  std::optional<Frame> frame() {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(kPatienceMs);
    while (true) {
      const auto head = take(2);
      if (!head) return std::nullopt;
      std::uint64_t size = static_cast<unsigned char>((*head)[1]) & 0x7fU;
      if (size >= 126) {
        const auto bytes = take(size == 126 ? 2 : 8);
        if (!bytes) return std::nullopt;
        size = 0;
        for (const char c : *bytes) size = size << 8U | static_cast<unsigned char>(c);
      }
      const auto payload = take(size);
      if (!payload) return std::nullopt;
      const int opcode = (*head)[0] & 0x0f;
      if (opcode == 9) {
        send_frame(0x8a, *payload);
        if (std::chrono::steady_clock::now() < deadline) continue;
        ADD_FAILURE() << "the server sent nothing but pings";
        return std::nullopt;
      }
      return Frame{opcode, *payload};
    }
  }

 private:
  static std::string cookie_line(const std::string& cookie) {
    return cookie.empty() ? "" : "Cookie: " + cookie + "\r\n";
  }

  bool send_post_from(const std::string& origin, const std::string& target, const std::string& body,
                      const std::string& cookie = "", const std::string& method = "POST") {
    return send(method + " " + target + " HTTP/1.1\r\nHost: " + host_ + "\r\n" +
                (origin.empty() ? "" : "Origin: " + origin + "\r\n") + cookie_line(cookie) +
                "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) +
                "\r\n\r\n" + body);
  }

  void bind_to(const char* address) {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    EXPECT_EQ(inet_pton(AF_INET, address, &own.sin_addr), 1) << address;
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own), 0) << address;
  }

  void shake_hands(const char* suites) {
    context_ = SSL_CTX_new(TLS_client_method());
    if (suites != nullptr) {
      SSL_CTX_set_max_proto_version(context_, TLS1_2_VERSION);
      SSL_CTX_set_cipher_list(context_, suites);
    }
    tls_ = SSL_new(context_);
    SSL_set_fd(tls_, socket_);
    connected_ = SSL_connect(tls_) == 1;
  }

  bool read_more() {
    char bytes[16384];
    pollfd ready{socket_, POLLIN, 0};
    if (!(tls_ && SSL_pending(tls_) > 0) && ::poll(&ready, 1, kPatienceMs) != 1) {
      ADD_FAILURE() << "the server neither answered nor closed";
      return false;
    }
    const ssize_t got = tls_ ? SSL_read(tls_, bytes, sizeof bytes) : ::recv(socket_, bytes, sizeof bytes, 0);
    if (got <= 0) return false;
    buffer_.append(bytes, static_cast<std::size_t>(got));
    return true;
  }

  int socket_ = -1;
  bool connected_ = false;
  SSL_CTX* context_ = nullptr;
  SSL* tls_ = nullptr;
  std::string host_, origin_, buffer_;
};

}  // namespace parhelion::test
