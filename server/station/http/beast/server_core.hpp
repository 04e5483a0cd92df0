// State shared by all connections of one server. Used on the server's thread, except the mailbox and the
// counts.
#pragma once

#include <atomic>
#include <map>
#include <set>

#include "server/station/http/beast/net_stream.hpp"
#include "server/station/http/beast/strangers.hpp"
#include "server/station/http/request_checks.hpp"
#include "server/station/http/routes.hpp"

namespace parhelion::station::net {

/// Posts work from any thread to the server's thread, and drops it when the server has ended.
class Mailbox {
 public:
  explicit Mailbox(asio::io_context& io) : io_(&io) {}
  void post(std::function<void()> task) {
    const std::lock_guard lock(mutex_);
    if (io_) asio::post(*io_, std::move(task));
  }
  void shut() {
    const std::lock_guard lock(mutex_);
    io_ = nullptr;
  }

 private:
  std::mutex mutex_;
  asio::io_context* io_;
};

/// An open WebSocket or picture stream.
class OpenClient {
 public:
  virtual ~OpenClient() = default;
  /// Called once a second: checks that it is still allowed and that the peer still reads.
  virtual void check(std::chrono::steady_clock::time_point now) = 0;
  /// Closes it at once and notifies its handler.
  virtual void finish() = 0;
};

struct ServerCore {
  ServerCore(HttpOptions server_options, std::vector<std::string> names)
      : options(std::move(server_options)), hosts(names), mailbox(std::make_shared<Mailbox>(io)) {}

  HttpOptions options;
  HostNames hosts;
  Routes routes;
  bool encrypted = false;
  std::string cookie_name;
  std::uint64_t last_id = 0;
  std::map<std::string, std::size_t> connections_by_network;
  Strangers strangers;
  std::atomic<std::uint64_t> connections{0}, clients{0}, accepted{0}, requests{0}, refused{0}, sent{0},
      received{0}, replaced{0};

  asio::io_context io{1};
  asio::ssl::context tls{asio::ssl::context::tls_server};
  std::shared_ptr<Mailbox> mailbox;
  std::set<std::shared_ptr<OpenClient>> open;
  std::set<std::shared_ptr<void>> waiting;  ///< connections with a pending late reply

  void refuse(WebRefusal refusal) {
    ++refused;
    if (options.refused) options.refused(refusal);
  }
  std::optional<Identity> identify(const std::string& session) const {
    if (session.empty() || !options.identify) return std::nullopt;
    return options.identify(session);
  }
};

/// Counts one connection against the limits of the server and of its address, until it ends or is closed.
class Admission {
 public:
  Admission(ServerCore& core, std::string remote, std::string network)
      : core_(core), remote_(std::move(remote)), network_(std::move(network)) {
    ++core_.connections;
    ++core_.connections_by_network[network_];
  }
  ~Admission() { end(); }
  Admission(const Admission&) = delete;
  Admission& operator=(const Admission&) = delete;

  const std::string& remote() const { return remote_; }
  const std::string& network() const { return network_; }
  void end() {
    if (ended_) return;
    ended_ = true;
    --core_.connections;
    const auto count = core_.connections_by_network.find(network_);
    if (--count->second == 0) core_.connections_by_network.erase(count);
  }

 private:
  ServerCore& core_;
  std::string remote_, network_;
  bool ended_ = false;
};

inline std::chrono::nanoseconds span(Duration duration) { return std::chrono::nanoseconds(duration.ns); }

/// Security headers of each reply.
template <class Fields>
void set_page_rules(Fields& fields, const std::string& host, bool encrypted) {
  const std::string sockets = host.empty() ? "" : (encrypted ? " wss://" : " ws://") + host;
  fields.set("X-Content-Type-Options", "nosniff");
  fields.set("Referrer-Policy", "no-referrer");
  fields.set("Cross-Origin-Opener-Policy", "same-origin");
  fields.set("Cross-Origin-Resource-Policy", "same-origin");
  fields.set("Permissions-Policy", "camera=(), microphone=(), geolocation=(), payment=(), usb=()");
  fields.set("X-Frame-Options", "DENY");
  fields.set("Content-Security-Policy",
             "default-src 'none'; script-src 'self'; style-src 'self'; "
             "img-src 'self' blob: data:; media-src 'self' blob:; font-src 'self'; worker-src 'self' blob:; "
             "manifest-src 'self'; connect-src 'self'" +
                 sockets + "; base-uri 'none'; form-action 'self'; frame-ancestors 'none'");
}

}  // namespace parhelion::station::net
