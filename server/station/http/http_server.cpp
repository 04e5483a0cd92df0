#include "server/station/http/http_server.hpp"

#include <netinet/tcp.h>
#include <unistd.h>

#include <array>
#include <thread>

#include "server/station/http/beast/connection.hpp"

namespace parhelion::station {
namespace {

using net::error_code;
using net::asio::ip::tcp;

/// Limit of unsent bytes in the kernel, since newer messages cannot replace those.
constexpr int kUnsentBytes = 16 * 1024;

std::string own_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

std::vector<std::string> host_names(const HttpOptions& options) {
  std::vector<std::string> names = options.names;
  if (const std::string own = own_name(); !own.empty()) {
    names.push_back(own);
    names.push_back(own + ".local");
  }
  return names;
}

Status set_up_tls(net::asio::ssl::context& context, const HttpOptions& options) {
  error_code error;
  context.set_options(SSL_OP_NO_RENEGOTIATION | net::asio::ssl::context::default_workarounds, error);
  SSL_CTX_set_min_proto_version(context.native_handle(), TLS1_2_VERSION);
  // Of TLS 1.2 only the suites that encrypt and authenticate in one (AEAD); TLS 1.3 has no others.
  SSL_CTX_set_cipher_list(context.native_handle(), "ECDHE+AESGCM:ECDHE+CHACHA20");
  context.use_certificate_chain_file(options.certificate, error);
  if (error) return Error{options.certificate + ": " + error.message() + "; expected a certificate in PEM"};
  context.use_private_key_file(options.key, net::asio::ssl::context::pem, error);
  if (error)
    return Error{options.key + ": " + error.message() + "; expected the certificate's private key in PEM"};
  return {};
}

std::string plain_address(const tcp::endpoint& endpoint) {
  const net::asio::ip::address address = endpoint.address();
  if (address.is_v6() && address.to_v6().is_v4_mapped()) {
    return net::asio::ip::make_address_v4(net::asio::ip::v4_mapped, address.to_v6()).to_string();
  }
  return address.to_string();
}

}  // namespace

struct HttpServer::Implementation {
  Implementation(HttpOptions options, std::vector<std::string> names)
      : core(std::move(options), std::move(names)) {}

  Status listen() {
    error_code error;
    const std::string& wanted = core.options.address;
    const auto address = net::asio::ip::make_address(wanted == "localhost" ? "127.0.0.1" : wanted, error);
    if (error)
      return Error{"'" + core.options.address +
                   "' is not an address of an interface; expected one like 127.0.0.1"};
    core.encrypted = !core.options.certificate.empty();
    if (!core.encrypted && !core.options.open_to_all && !address.is_loopback()) {
      return Error{"without a certificate only this machine may connect; give one to listen on " +
                   core.options.address};
    }
    const tcp::endpoint endpoint(address, core.options.port);
    acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(net::asio::socket_base::max_listen_connections, error);
    if (error) {
      return Error{"cannot listen on " + core.options.address + " port " + std::to_string(core.options.port) +
                   ": " + error.message() + "; choose another port"};
    }
    port = acceptor.local_endpoint().port();
    core.cookie_name = (core.encrypted ? "__Host-parhelion-" : "parhelion-") + std::to_string(port);
    return {};
  }

  void accept() {
    acceptor.async_accept([this](error_code error, tcp::socket socket) {
      if (error == net::asio::error::operation_aborted) return;
      if (error) {
        // Usually out of file descriptors, until other connections close.
        pause.expires_after(std::chrono::milliseconds(100));
        return pause.async_wait([this](error_code stopped) {
          if (!stopped) accept();
        });
      }
      admit(std::move(socket));
      accept();
    });
  }

  /// Closes connections without a log-in for one more from `network`. False: all others are logged in.
  bool make_room(const std::string& network, bool local) {
    const HttpOptions& limits = core.options;
    const auto from_there = core.connections_by_network.find(network);
    if (!local && from_there != core.connections_by_network.end() &&
        from_there->second >= limits.connections_per_address &&
        !dismiss(core.strangers.first_to_go(network))) {
      return false;
    }
    if (core.connections < limits.connections && core.strangers.count() < limits.strangers) return true;
    return dismiss(core.strangers.first_to_go());
  }

  static bool dismiss(net::Stranger* stranger) {
    if (stranger != nullptr) stranger->dismiss();
    return stranger != nullptr;
  }

  void admit(tcp::socket socket) {
    ++core.accepted;
    error_code error;
    const tcp::endpoint other = socket.remote_endpoint(error);
    if (error) return;
    const std::string remote = plain_address(other), network = network_of(remote);
    if (!make_room(network, net::asio::ip::make_address(remote).is_loopback()))
      return core.refuse({remote, "", "a connection", "too many are open", 0});
    socket.set_option(tcp::no_delay(true), error);
    setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentBytes, sizeof kUnsentBytes);
    std::make_shared<net::Connection>(core, std::move(socket),
                                      std::make_unique<net::Admission>(core, remote, network))
        ->start();
  }

  void check_clients() {
    each_second.expires_after(std::chrono::seconds(1));
    each_second.async_wait([this](error_code error) {
      if (error) return;
      // Copy: check() may close some.
      const auto clients = core.open;
      for (const auto& client : clients) client->check(std::chrono::steady_clock::now());
      check_clients();
    });
  }

  /// An exception in a handler closes its connection, not the server.
  void serve() {
    while (!core.io.stopped()) {
      try {
        core.io.run();
      } catch (const std::exception& fault) {
        core.refuse({"", "", "a handler", std::string("failed: ") + fault.what(), 500});
      }
    }
  }

  void end() {
    core.mailbox->shut();
    acceptor.close();
    const auto clients = core.open;
    for (const auto& client : clients) client->finish();
    core.waiting.clear();
  }

  net::ServerCore core;
  tcp::acceptor acceptor{core.io};
  net::asio::steady_timer pause{core.io}, each_second{core.io};
  std::uint16_t port = 0;
  std::thread thread;
};

HttpServer::HttpServer(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}

HttpServer::~HttpServer() { stop(); }

void HttpServer::stop() {
  Implementation& server = *implementation_;
  server.core.io.stop();
  if (server.thread.joinable()) server.thread.join();
  server.end();
}

Result<std::unique_ptr<HttpServer>> HttpServer::open(HttpOptions options) {
  std::vector<std::string> names = host_names(options);
  auto implementation = std::make_unique<Implementation>(std::move(options), std::move(names));
  net::ServerCore& core = implementation->core;
  if (core.options.certificate.empty() != core.options.key.empty()) {
    return Error{"a certificate and its key belong together; give both or none"};
  }
  if (!core.options.certificate.empty()) {
    if (const Status tls = set_up_tls(core.tls, core.options); !tls) return tls.error();
  }
  if (const Status listening = implementation->listen(); !listening) return listening.error();
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(implementation)));
}

void HttpServer::on(std::string method, std::string path, Access access, Handler handler) {
  implementation_->core.routes.add({std::move(method), std::move(path), access, std::move(handler)});
}

void HttpServer::on_late(std::string method, std::string path, Access access, LateHandler handler) {
  implementation_->core.routes.add({std::move(method), std::move(path), access, std::move(handler)});
}

void HttpServer::on_socket(std::string path, Access access, SocketHandler handler, SocketTerms terms) {
  implementation_->core.routes.add(
      {"GET", std::move(path), access, SocketRoute{std::move(handler), std::move(terms)}});
}

void HttpServer::on_stream(std::string path, Access access, std::string content_type, SocketHandler handler) {
  implementation_->core.routes.add(
      {"GET", std::move(path), access, StreamRoute{std::move(handler), std::move(content_type)}});
}

void HttpServer::run() {
  implementation_->thread = std::thread([server = implementation_.get()] {
    server->accept();
    server->check_clients();
    server->serve();
  });
}

void HttpServer::post(std::function<void()> task) { implementation_->core.mailbox->post(std::move(task)); }

std::uint16_t HttpServer::port() const { return implementation_->port; }
bool HttpServer::encrypted() const { return implementation_->core.encrypted; }
const std::string& HttpServer::cookie_name() const { return implementation_->core.cookie_name; }

HttpCounts HttpServer::counts() const {
  const net::ServerCore& core = implementation_->core;
  return {core.connections, core.clients, core.accepted, core.requests,
          core.refused,     core.sent,    core.received, core.replaced};
}

}  // namespace parhelion::station
