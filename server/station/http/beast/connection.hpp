// One connection: handles its requests one after the other, checks each and passes it to its route.
#pragma once

#include "server/station/http/beast/client_session.hpp"

namespace parhelion::station::net {

class Connection : public Stranger, public std::enable_shared_from_this<Connection> {
 public:
  Connection(ServerCore& core, tcp::socket&& socket, std::unique_ptr<Admission> admission)
      : core_(core), stream_(std::move(socket), core.tls), admission_(std::move(admission)) {
    core_.strangers.add(*this, admission_->network());
  }
  ~Connection() override { core_.strangers.remove(*this); }

  bool idle() const override { return idle_; }
  void dismiss() override {
    core_.refuse({admission_->remote(), "", "a connection",
                  "too many are open without a log-in: closed for a newer one", 0});
    core_.strangers.remove(*this);
    admission_->end();
    stream_.close();
  }

  void start() {
    allow(core_.options.request_time);
    if (!core_.encrypted) return read_header();
    // The first byte shows whether the peer speaks TLS.
    stream_.async_read_some(buffer_.prepare(1024),
                            [self = shared_from_this()](error_code error, std::size_t bytes) {
                              if (error) return self->lost();
                              self->buffer_.commit(bytes);
                              self->first_bytes();
                            });
  }

 private:
  static constexpr char kTlsHandshake = 0x16;

  void allow(Duration time) { stream_.connection().expires_after(span(time)); }

  void first_bytes() {
    if (*static_cast<const char*>(buffer_.cdata().data()) != kTlsHandshake) {
      unencrypted_ = true;
      return read_header();
    }
    stream_.handshake(buffer_.data(), [self = shared_from_this()](error_code error, std::size_t used) {
      if (error) return self->lost();
      self->buffer_.consume(used);
      self->read_header();
    });
  }

  void read_header() {
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(core_.options.header_bytes));
    parser_->body_limit(core_.options.body_bytes);
    http::async_read_header(stream_, buffer_, *parser_,
                            [self = shared_from_this()](error_code error, std::size_t bytes) {
                              self->core_.received += bytes;
                              if (error) return self->unreadable(error);
                              self->header_read();
                            });
  }

  void header_read() {
    ++core_.requests;
    idle_ = false;
    const auto& header = parser_->get();
    keep_alive_ = header.keep_alive();
    head_only_ = header.method() == http::verb::head;
    host_ = text(header[http::field::host]);
    request_ = HttpRequest{};
    request_.remote = admission_->remote();
    request_.local = asio::ip::make_address(request_.remote).is_loopback();
    request_.method = head_only_ ? "GET" : text(header.method_string());
    request_.session = cookie_value(text(header[http::field::cookie]), core_.cookie_name);
    request_.content_type = text(header[http::field::content_type]);
    request_.if_none_match = text(header[http::field::if_none_match]);
    request_.accept_encoding = text(header[http::field::accept_encoding]);

    // RFC 9112, 3.2.
    if (header.count(http::field::host) > 1) return refuse(400, "more than one Host header");
    const auto target = parse_target(text(header.target()));
    if (!target) return refuse(400, "invalid path");
    request_.path = target->path;
    request_.query = target->query;
    const Routes::Found found = core_.routes.find(request_.method, request_.path);
    const SocketRoute* socket = found.route ? std::get_if<SocketRoute>(&found.route->target) : nullptr;
    if (!core_.hosts.knows(host_)) return refuse(421, "the Host header does not name this server");
    if (unencrypted_) return send_elsewhere(text(header.target()));
    if (!found.route) {
      return found.methods.empty() ? answer(refusal(404, "no such page"))
                                   : answer({.status = 405,
                                             .body = R"({"error":"not with this method"})",
                                             .headers = {{"Allow", found.methods}}});
    }
    request_.who = core_.identify(request_.session);
    if (request_.who) core_.strangers.remove(*this);
    const bool asks_to_change = request_.method != "GET" || socket;
    const std::string origin = text(header[http::field::origin]);
    const bool welcome =
        same_origin(origin, host_, core_.encrypted) ||
        (socket && socket->terms.programs && program_origin(origin, host_, socket->terms.origins));
    if (asks_to_change && !welcome) {
      return refuse(403, "Origin is missing or another site's");
    }
    const Identity* who = request_.who ? &*request_.who : nullptr;
    if (!found.route->access.allows(who, request_.local)) {
      return who ? refuse(403, "not with the role " + std::string(role_name(who->role)))
                 : refuse(401,
                          request_.session.empty() ? "not logged in" : "the session has ended; log in again");
    }
    route_ = found.route;
    if (socket) return open_socket(*socket);
    if (websocket::is_upgrade(header)) return refuse(400, "this path is not a WebSocket");
    if (const auto* stream = std::get_if<StreamRoute>(&route_->target)) return open_stream(*stream);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](error_code error, std::size_t bytes) {
                       self->core_.received += bytes;
                       if (error) return self->unreadable(error);
                       self->request_.body = std::move(self->parser_->get().body());
                       self->call();
                     });
  }

  void call() {
    stream_.connection().expires_never();
    if (const auto* handler = std::get_if<HttpServer::Handler>(&route_->target))
      return answer((*handler)(request_));
    // Late replies hold no reference to the connection, since the server may have ended.
    struct Late {
      std::shared_ptr<Mailbox> mailbox;
      std::weak_ptr<Connection> connection;
      std::atomic<bool> given{false};
      void give(HttpResponse response) {
        if (given.exchange(true)) return;
        mailbox->post([to = connection, response = std::move(response)]() mutable {
          if (const auto self = to.lock()) self->answer(std::move(response));
        });
      }
      ~Late() { give(refusal(503, "no reply; try again")); }
    };
    const auto late = std::make_shared<Late>();
    late->mailbox = core_.mailbox;
    late->connection = shared_from_this();
    core_.waiting.insert(shared_from_this());
    std::get<HttpServer::LateHandler>(route_->target)(request_,
                                                      [late](HttpResponse r) { late->give(std::move(r)); });
  }

  void open_socket(const SocketRoute& route) {
    const auto& header = parser_->get();
    if (!websocket::is_upgrade(header)) {
      return answer(
          {.status = 426, .body = R"({"error":"a WebSocket"})", .headers = {{"Upgrade", "websocket"}}});
    }
    const std::string protocol =
        chosen_protocol(text(header[http::field::sec_websocket_protocol]), route.terms.protocols);
    if (!route.terms.protocols.empty() && protocol.empty()) return refuse(400, "no supported subprotocol");
    std::make_shared<SocketSession>(core_, client_start(), route.handler, std::move(stream_))
        ->accept(parser_->get(), protocol);
  }

  void open_stream(const StreamRoute& route) {
    if (head_only_) return answer({.status = 200, .type = route.content_type});
    std::make_shared<StreamSession>(core_, client_start(), route, std::move(stream_))->begin();
  }

  ClientStart client_start() {
    core_.strangers.remove(*this);
    WebClientOrigin origin{++core_.last_id, request_.who.value_or(Identity{}), request_.remote, request_.path,
                           request_.query};
    return {std::move(request_), host_, std::move(admission_), std::move(origin)};
  }

  static std::string chosen_protocol(std::string_view offered, const std::vector<std::string>& known) {
    for (const std::string& protocol : known) {
      for (const auto& offer : http::token_list(boost::string_view(offered.data(), offered.size()))) {
        if (offer == protocol) return protocol;
      }
    }
    return "";
  }

  /// Redirects a client that speaks plain HTTP to an encrypted port.
  void send_elsewhere(const std::string& target) {
    keep_alive_ = false;
    answer({.status = 308, .body = "", .headers = {{"Location", "https://" + host_ + target}}});
  }

  void refuse(int status, std::string why) {
    core_.refuse({admission_->remote(), request_.who ? request_.who->name : "",
                  request_.method + " " + path_of(parser_->get().target()), why, status});
    answer(refusal(status, why));
  }

  /// The input is not a request, or did not arrive in time.
  void unreadable(error_code error) {
    if (error == http::error::end_of_stream || error == asio::error::connection_reset) return lost();
    keep_alive_ = false;
    int status = 400;
    std::string why = error.message();
    if (error == http::error::header_limit || error == http::error::buffer_overflow) {
      status = 431;
      why = "the header is longer than " + std::to_string(core_.options.header_bytes) + " bytes";
    } else if (error == http::error::body_limit) {
      status = 413;
      why = "the body is longer than " + std::to_string(core_.options.body_bytes) + " bytes";
    } else if (error.category() != make_error_code(http::error::bad_method).category()) {
      // No reply is pending, or the timeout has passed.
      if (parser_->got_some()) core_.refuse({admission_->remote(), "", "a request", why, 0});
      return stream_.close();
    }
    core_.refuse({admission_->remote(), "", "a request", why, status});
    answer(refusal(status, why));
  }

  /// Normal for browsers, too: reserved connections, untrusted certificates.
  void lost() { stream_.close(); }

  void answer(HttpResponse response) {
    const auto self_kept = shared_from_this();
    core_.waiting.erase(self_kept);
    // An unread body would precede the next request.
    if (!parser_->is_done()) keep_alive_ = false;
    content_ = std::move(response);
    const std::string& body = content_.shared_body ? *content_.shared_body : content_.body;
    http::response<http::span_body<const char>> out{static_cast<http::status>(content_.status), 11};
    set_page_rules(out, core_.hosts.knows(host_) ? host_ : "", core_.encrypted);
    out.set(http::field::cache_control, "no-store");
    for (const auto& [name, value] : content_.headers) {
      // set() would merge several of these into one.
      if (name == "Set-Cookie") {
        out.insert(name, value);
      } else {
        out.set(name, value);
      }
    }
    out.keep_alive(keep_alive_);
    if (content_.status != 204 && content_.status != 304) {
      out.set(http::field::content_type, content_.type);
      out.content_length(body.size());
      if (!head_only_) out.body() = beast::span<const char>(body.data(), body.size());
    }
    response_.emplace(std::move(out));
    serializer_.emplace(*response_);
    allow(core_.options.write_time);
    http::async_write(stream_, *serializer_,
                      [self = shared_from_this()](error_code error, std::size_t bytes) {
                        self->core_.sent += bytes;
                        self->answered(error);
                      });
  }

  void answered(error_code error) {
    if (error) return stream_.close();
    content_ = {};
    if (!keep_alive_) {
      stream_.shut_down();
      allow(kLingerTime);
      return drain(kLingerBytes);
    }
    idle_ = true;
    allow(core_.options.idle_time);
    if (buffer_.size() > 0) {
      allow(core_.options.request_time);
      return read_header();
    }
    // The timeout of the next request starts with its first byte.
    stream_.async_read_some(buffer_.prepare(1024),
                            [self = shared_from_this()](error_code idle, std::size_t bytes) {
                              if (idle) return self->stream_.close();
                              self->buffer_.commit(bytes);
                              self->allow(self->core_.options.request_time);
                              self->read_header();
                            });
  }

  /// Reads for a moment longer: closing with unread bytes would discard the reply at the peer.
  void drain(std::size_t bytes_left) {
    buffer_.clear();
    stream_.async_read_some(buffer_.prepare(4096),
                            [self = shared_from_this(), bytes_left](error_code error, std::size_t bytes) {
                              if (error || bytes >= bytes_left) return self->stream_.close();
                              self->drain(bytes_left - bytes);
                            });
  }

  static constexpr Duration kLingerTime = seconds(2.0);
  static constexpr std::size_t kLingerBytes = 1 << 20;

  /// For the log, since queries contain tokens.
  static std::string path_of(boost::string_view target) {
    return text(target.substr(0, std::min<std::size_t>(target.find('?'), 200)));
  }
  static std::string text(boost::string_view view) { return {view.data(), view.size()}; }

  ServerCore& core_;
  NetStream stream_;
  std::unique_ptr<Admission> admission_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  std::optional<http::response<http::span_body<const char>>> response_;
  std::optional<http::response_serializer<http::span_body<const char>>> serializer_;
  HttpRequest request_;
  HttpResponse content_;
  std::string host_;
  const Route* route_ = nullptr;
  bool idle_ = true, keep_alive_ = false, head_only_ = false, unencrypted_ = false;
};

}  // namespace parhelion::station::net
