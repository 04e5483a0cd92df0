// The whole base station: web server, log-in, page, state, video, driving. `serve`, `demo` and `play` start
// it with --http.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/station/station.hpp"

namespace parhelion::station {

struct BaseStationOptions {
  std::string address = "127.0.0.1:0";  ///< ADDR:PORT, [ADDR]:PORT or PORT; port 0: any that is free
  std::filesystem::path folder;  ///< accounts, log-ins, certificate, audit log; empty: default_site_folder()
  std::optional<bool> plain;     ///< no encryption; none: only if the server is reachable from this machine
                                 ///< alone
  StationOptions station;        ///< its emergency stop and audit are set by this class
  std::string why_not_driven;  ///< reason, for people, why the trainee's robot cannot be driven; empty: pages
                               ///< can drive it
  std::vector<std::string> stopped_robots;  ///< emergency stops of an earlier server process still hold these
                                            ///< robot
  /// Opens an endpoint of the session's bus, for each part of the station. Called on a thread whose priority
  /// the station's threads inherit.
  std::function<Result<std::unique_ptr<Bus>>()> open_bus;
};

class BaseStation {
 public:
  /// Listens and serves until it is destroyed. Error: the address cannot be used, or a file cannot be
  /// written.
  static Result<std::unique_ptr<BaseStation>> open(BaseStationOptions options);
  ~BaseStation();
  BaseStation(const BaseStation&) = delete;
  BaseStation& operator=(const BaseStation&) = delete;

  std::string address() const;      ///< link for people
  std::string setup_link() const;   ///< creates the first account, once; empty: there are accounts
  std::string fingerprint() const;  ///< SHA-256 of the certificate; empty: plain
  /// Logs in anybody who opens it, as long as this process lives.
  std::string link(Role role, const std::string& name);
  /// Address, set-up link, fingerprint and lost log-ins, for a person at a terminal.
  std::string invitation() const;
  /// The session has ended: pages drive no more.
  void end_driving();
  /// For /api/v1/report and /report, after the session has ended.
  void set_report(SessionReport report);

 private:
  struct Parts;
  explicit BaseStation(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

struct HostPort {
  std::string host;
  std::uint16_t port = 0;
};
/// The error describes what was expected.
Result<HostPort> parse_host_port(const std::string& text);

}  // namespace parhelion::station
