// A minimal unencrypted WebSocket client on this machine, just enough to load a server.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

namespace parhelion::bench {

inline int connect_to(std::uint16_t port) {
  const int socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error("nobody listens on port " + std::to_string(port));
  return socket_;
}

inline void write_all(int socket_, const std::string& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = send(socket_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
    if (n <= 0) throw std::runtime_error("the server has closed a connection");
    done += static_cast<std::size_t>(n);
  }
}

/// Status line and headers; the body stays in the socket.
inline std::string read_head(int socket_) {
  std::string head;
  char c;
  while (!head.ends_with("\r\n\r\n")) {
    if (recv(socket_, &c, 1, 0) != 1) throw std::runtime_error("the server answered '" + head + "'");
    head += c;
  }
  return head;
}

/// POST; returns the cookie set by the response, or empty. Throws if the response is no success.
inline std::string post(std::uint16_t port, const std::string& path, const std::string& cookie,
                        const std::string& body) {
  const int socket_ = connect_to(port);
  const std::string host = "127.0.0.1:" + std::to_string(port);
  write_all(socket_, "POST " + path + " HTTP/1.1\r\nHost: " + host + "\r\nOrigin: http://" + host +
                         "\r\nContent-Type: application/json\r\nConnection: close\r\nCookie: " + cookie +
                         "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
  const std::string head = read_head(socket_);
  close(socket_);
  if (!head.starts_with("HTTP/1.1 2")) throw std::runtime_error(path + ": " + head);
  const std::size_t at = head.find("Set-Cookie: ");
  return at == std::string::npos ? "" : head.substr(at + 12, head.find(';', at) - at - 12);
}

/// Descriptor of an open WebSocket, with a receive buffer as large as a browser's.
inline int open_web_socket(std::uint16_t port, const std::string& path, const std::string& cookie) {
  const int socket_ = connect_to(port);
  const std::string host = "127.0.0.1:" + std::to_string(port);
  write_all(socket_, "GET " + path + " HTTP/1.1\r\nHost: " + host + "\r\nOrigin: http://" + host +
                         "\r\nCookie: " + cookie +
                         "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                         "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n");
  if (const std::string head = read_head(socket_); !head.starts_with("HTTP/1.1 101"))
    throw std::runtime_error(path + ": " + head);
  return socket_;
}

/// A text message of at most 125 bytes, masked with zeros.
inline void send_text(int socket_, const std::string& text) {
  std::string frame{static_cast<char>(0x81), static_cast<char>(0x80 | text.size()), 0, 0, 0, 0};
  write_all(socket_, frame + text);
}

/// An unsolicited pong, which keeps the connection alive like a browser's reply to a ping.
inline void pong(int socket_) {
  write_all(socket_, {static_cast<char>(0x8a), static_cast<char>(0x80), 0, 0, 0, 0});
}

}  // namespace parhelion::bench
