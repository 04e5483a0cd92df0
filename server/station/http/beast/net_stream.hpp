// A connection with or without TLS as one type, so that code built on it is compiled once. Headers of this
// folder are included by http_server.cpp alone.
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/http/span_body.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>

namespace parhelion::station::net {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using beast::error_code;

class NetStream {
 public:
  using executor_type = beast::tcp_stream::executor_type;

  NetStream(tcp::socket&& socket, asio::ssl::context& context) : tls_(std::move(socket), context) {}

  executor_type get_executor() { return tls_.get_executor(); }
  beast::tcp_stream& connection() { return tls_.next_layer(); }
  tcp::socket& socket() { return connection().socket(); }

  /// `begun`: bytes already received from the peer. Calls handler(error_code, bytes of `begun` used).
  template <class Buffers, class Handler>
  void handshake(const Buffers& begun, Handler&& handler) {
    encrypted_ = true;
    tls_.async_handshake(asio::ssl::stream_base::server, begun, std::forward<Handler>(handler));
  }

  template <class Buffers, class Handler>
  auto async_read_some(const Buffers& buffers, Handler&& handler) {
    return asio::async_initiate<Handler, void(error_code, std::size_t)>(
        [this](auto done, const Buffers& into) {
          if (encrypted_) {
            tls_.async_read_some(into, std::move(done));
          } else {
            connection().async_read_some(into, std::move(done));
          }
        },
        handler, buffers);
  }

  template <class Buffers, class Handler>
  auto async_write_some(const Buffers& buffers, Handler&& handler) {
    return asio::async_initiate<Handler, void(error_code, std::size_t)>(
        [this](auto done, const Buffers& from) {
          if (encrypted_) {
            tls_.async_write_some(from, std::move(done));
          } else {
            connection().async_write_some(from, std::move(done));
          }
        },
        handler, buffers);
  }

  /// Data already sent still arrives.
  void shut_down() {
    error_code ignored;
    socket().shutdown(tcp::socket::shutdown_send, ignored);
  }
  void close() {
    error_code ignored;
    socket().close(ignored);
  }

 private:
  beast::ssl_stream<beast::tcp_stream> tls_;
  bool encrypted_ = false;
};

// Required by Beast of a stream under a WebSocket. The closing handshake is done or not wanted at this point.
inline void teardown(beast::role_type, NetStream& stream, error_code& error) {
  stream.close();
  error = {};
}

template <class Handler>
void async_teardown(beast::role_type, NetStream& stream, Handler&& handler) {
  stream.shut_down();
  asio::post(stream.get_executor(), beast::bind_front_handler(std::forward<Handler>(handler), error_code{}));
}

inline void beast_close_socket(NetStream& stream) { stream.close(); }

}  // namespace parhelion::station::net
