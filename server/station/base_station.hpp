// The whole base station: web server, log-in, page, state, video, driving. What `serve`, `demo` and `play`
// open with --http.
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
  std::filesystem::path folder;         ///< accounts, certificate, audit log; empty: default_site_folder()
  std::optional<bool> plain;   ///< without encryption; none: where only this machine's own browser can ask
  StationOptions station;      ///< its emergency stop and audit are this class's own
  std::string why_not_driven;  ///< why nobody can drive the trainee's robot, for people; empty: pages can
  bool robot_stopped = false;  ///< the trainee's, by an emergency stop that a server which died was told of
  /// An endpoint of the session's bus, called once, on a thread whose priority its own threads take.
  std::function<Result<std::unique_ptr<Bus>>()> open_bus;
};

class BaseStation {
 public:
  /// Listens and serves until it goes. Error: the address cannot be used, a file cannot be written.
  static Result<std::unique_ptr<BaseStation>> open(BaseStationOptions options);
  ~BaseStation();
  BaseStation(const BaseStation&) = delete;
  BaseStation& operator=(const BaseStation&) = delete;

  std::string address() const;      ///< link for people
  std::string setup_link() const;   ///< makes the first account, once; empty: there are accounts
  std::string fingerprint() const;  ///< SHA-256 of the certificate; empty: plain
  /// Logs in whoever opens it, as long as this process lives.
  std::string link(Role role, const std::string& name);
  /// Those three, for a person at a terminal.
  std::string invitation() const;
  /// For /api/v1/report and /report, after the end; `page` may be empty.
  void set_report(std::string json, std::string page);

 private:
  struct Parts;
  explicit BaseStation(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

struct HostPort {
  std::string host;
  std::uint16_t port = 0;
};
/// Error: says what was expected.
Result<HostPort> parse_host_port(const std::string& text);

}  // namespace parhelion::station
