// A web server with all application-independent parts: certificate, accounts, log-in, audit, metrics.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/station/http/audit.hpp"
#include "server/station/http/http_server.hpp"
#include "server/station/http/metrics_text.hpp"
#include "server/station/http/sessions.hpp"

namespace parhelion::station {

struct WebSiteOptions {
  HttpOptions http =
      {};  ///< without certificate and key one is created; identify and refused are set by the site
  /// Accounts, log-ins, certificate, audit log. Created for its owner alone if it does not exist.
  std::filesystem::path folder = {};
  bool plain = false;  ///< no encryption: only for a browser on this machine
  /// Handles "/" and all paths without a route; empty: 404.
  HttpServer::Handler page = {};
  SessionLimits sessions = {};
  std::function<WallTime()> clock = {};   ///< since the epoch; empty: the machine's
  std::function<WallTime()> steady = {};  ///< monotonic; empty: the machine's
};

/// $XDG_STATE_HOME/parhelion, or ~/.local/state/parhelion.
std::filesystem::path default_site_folder();

class WebSite {
 public:
  static Result<std::unique_ptr<WebSite>> open(WebSiteOptions options);
  ~WebSite();

  /// Register further routes before run().
  HttpServer& server();
  Audit& audit();
  /// Call before run(). `add` is called on the server's thread for each GET /metrics.
  void metrics(std::function<void(MetricsText&)> add);
  void run();
  /// Closes everything; no handler is called any more. The audit log stays open.
  void stop();

  /// "https://192.168.1.5:8443/": for people.
  std::string address() const;
  /// Creates the first account, once; empty: there are accounts.
  std::string setup_link() const;
  /// Why nobody is logged in any more after a restart, for people; empty: log-ins survived, or there were
  /// none.
  const std::string& restore_fault() const;
  /// SHA-256 of the certificate; empty: plain.
  const std::string& fingerprint() const;
  /// Logs in anybody who opens it, as long as this process lives.
  std::string link(Role role, const std::string& name);

 private:
  struct Parts;
  explicit WebSite(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace parhelion::station
