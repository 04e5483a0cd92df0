// Open WebSockets and picture streams: sends the content of their queues and passes on received messages.
#pragma once

#include <sstream>

#include "server/station/http/beast/server_core.hpp"
#include "server/station/http/client_queue.hpp"

namespace parhelion::station::net {

/// Result of a request that opens one.
struct ClientStart {
  HttpRequest request;
  std::string host;
  std::unique_ptr<Admission> admission;
  WebClientOrigin origin;
};

/// Common part of both kinds. Kept alive by the server's list until finish(), then by its last handler.
class ClientSession : public OpenClient, public std::enable_shared_from_this<ClientSession> {
 public:
  ClientSession(ServerCore& core, ClientStart start, const SocketHandler& handler)
      : core_(core), start_(std::move(start)), handler_(handler) {}

  void check(std::chrono::steady_clock::time_point now) override {
    if (stuck_since_ && now - *stuck_since_ > span(core_.options.write_time)) {
      refuse("does not read any more");
      return finish();
    }
    if (start_.request.session.empty()) return;
    if (!core_.identify(start_.request.session)) queue_->close(1008, "logged out");
  }

  void finish() override {
    const auto self = shared_from_this();
    if (core_.open.erase(self) == 0) return;
    --core_.clients;
    core_.replaced += queue_->replaced();
    queue_->end();
    shut();
    if (handler_.closed) handler_.closed(*queue_);
  }

 protected:
  void opened() {
    const std::weak_ptr<ClientSession> weak = shared_from_this();
    queue_ = std::make_shared<ClientQueue>(start_.origin, core_.options.waiting_bytes,
                                           [mailbox = core_.mailbox, weak] {
                                             mailbox->post([weak] {
                                               if (const auto self = weak.lock()) self->pump();
                                             });
                                           });
    core_.open.insert(shared_from_this());
    ++core_.clients;
    if (handler_.opened) handler_.opened(queue_);
  }

  /// Sends the next message, unless one is being sent.
  void pump() {
    if (stuck_since_ || closing_ || !core_.open.contains(shared_from_this())) return;
    ClientQueue::Next next = queue_->take();
    if (!next.message && !next.closing) return;
    stuck_since_ = std::chrono::steady_clock::now();
    if (next.closing) {
      closing_ = true;
      // Clients closed for a violation or for not reading are recorded.
      if (next.closing->code == 1008 || next.closing->code == 1013) refuse(next.closing->why);
      write_close(next.closing->code, next.closing->why);
    } else {
      writing_ = std::move(next.message->bytes);
      write(*writing_, next.message->binary);
    }
  }

  void written(error_code error, std::size_t bytes) {
    stuck_since_.reset();
    core_.sent += bytes;
    if (error) return finish();
    pump();
  }

  void refuse(std::string why) {
    core_.refuse({start_.origin.remote, start_.origin.who.name, "message on " + start_.origin.path,
                  std::move(why), 0});
  }

  virtual void write(const std::string& bytes, bool binary) = 0;
  virtual void write_close(int code, const std::string& why) = 0;
  virtual void shut() = 0;

  ServerCore& core_;
  ClientStart start_;
  const SocketHandler& handler_;
  std::shared_ptr<ClientQueue> queue_;
  std::shared_ptr<const std::string> writing_;
  std::optional<std::chrono::steady_clock::time_point> stuck_since_;
  bool closing_ = false;
};

class SocketSession : public ClientSession {
 public:
  SocketSession(ServerCore& core, ClientStart start, const SocketHandler& handler, NetStream&& stream)
      : ClientSession(core, std::move(start), handler), socket_(std::move(stream)) {}

  /// `request` and `protocol` (may be empty): what the client requested and gets.
  void accept(const http::request<http::string_body>& request, const std::string& protocol) {
    socket_.next_layer().connection().expires_never();
    websocket::stream_base::timeout times;
    times.handshake_timeout = span(core_.options.request_time);
    times.idle_timeout = span(core_.options.idle_time);
    times.keep_alive_pings = true;
    socket_.set_option(times);
    socket_.set_option(websocket::stream_base::decorator([protocol](websocket::response_type& response) {
      if (!protocol.empty()) response.set(http::field::sec_websocket_protocol, protocol);
    }));
    socket_.read_message_max(core_.options.message_bytes);
    socket_.auto_fragment(false);
    socket_.async_accept(request, [self = me()](error_code error) {
      if (error) return self->refuse("handshake: " + error.message());
      self->opened();
      self->read();
    });
  }

 private:
  std::shared_ptr<SocketSession> me() { return std::static_pointer_cast<SocketSession>(shared_from_this()); }

  void read() {
    socket_.async_read(incoming_,
                       [self = me()](error_code error, std::size_t bytes) { self->received(error, bytes); });
  }

  void received(error_code error, std::size_t bytes) {
    if (error) {
      // Beast has informed the peer. Only protocol errors are logged, not disconnections.
      if (error.category() == websocket::make_error_code(websocket::error::closed).category() &&
          error != websocket::error::closed) {
        refuse(error.message());
      }
      return finish();
    }
    core_.received += bytes;
    if (!closing_ && core_.open.contains(shared_from_this())) hand_on();
    incoming_.consume(incoming_.size());
    if (core_.open.contains(shared_from_this())) read();
  }

  void hand_on() {
    const auto content = incoming_.cdata();
    try {
      handler_.received(*queue_, {static_cast<const char*>(content.data()), content.size()},
                        socket_.got_binary());
    } catch (const std::exception& fault) {
      refuse(std::string("its handler failed: ") + fault.what());
      queue_->close(1011, "a fault of the server");
    }
  }

  void write(const std::string& bytes, bool binary) override {
    socket_.binary(binary);
    socket_.async_write(asio::buffer(bytes),
                        [self = me()](error_code error, std::size_t sent) { self->written(error, sent); });
  }

  void write_close(int code, const std::string& why) override {
    websocket::close_reason reason(static_cast<websocket::close_code>(code));
    // A control frame has at most 125 bytes; the code takes two.
    reason.reason.assign(why.substr(0, std::min<std::size_t>(why.size(), reason.reason.max_size())));
    socket_.async_close(reason, [self = me()](error_code) { self->finish(); });
  }

  void shut() override { socket_.next_layer().close(); }

  websocket::stream<NetStream> socket_;
  beast::flat_buffer incoming_;
};

class StreamSession : public ClientSession {
 public:
  StreamSession(ServerCore& core, ClientStart start, const StreamRoute& route, NetStream&& stream)
      : ClientSession(core, std::move(start), route.handler),
        stream_(std::move(stream)),
        content_type_(route.content_type) {}

  void begin() {
    stream_.connection().expires_never();
    http::response<http::empty_body> head{http::status::ok, 11};
    set_page_rules(head, start_.host, core_.encrypted);
    head.set(http::field::content_type, content_type_);
    head.set(http::field::cache_control, "no-store");
    head.set(http::field::connection, "close");
    std::ostringstream text;
    text << head.base();
    head_ = text.str();
    opened();
    stuck_since_ = std::chrono::steady_clock::now();
    write(head_, false);
    watch();
  }

 private:
  std::shared_ptr<StreamSession> me() { return std::static_pointer_cast<StreamSession>(shared_from_this()); }

  /// No input is expected; a read detects that the peer has disconnected.
  void watch() {
    stream_.async_read_some(asio::buffer(ignored_), [self = me()](error_code error, std::size_t) {
      if (error) return self->finish();
      if (self->core_.open.contains(self)) self->watch();
    });
  }

  void write(const std::string& bytes, bool) override {
    asio::async_write(stream_, asio::buffer(bytes),
                      [self = me()](error_code error, std::size_t sent) { self->written(error, sent); });
  }
  void write_close(int, const std::string&) override { finish(); }
  void shut() override { stream_.close(); }

  NetStream stream_;
  std::string content_type_, head_;
  std::array<char, 512> ignored_{};
};

}  // namespace parhelion::station::net
