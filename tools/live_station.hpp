// The base station of a live server, for `serve --http`.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "server/runtime/report.hpp"
#include "server/runtime/session_clock.hpp"
#include "server/station/base_station.hpp"

namespace parhelion::tools {

struct LiveStationOptions {
  std::string address;  ///< ADDR:PORT
  std::string folder;   ///< accounts, certificate, saved scenarios; empty: the user's default
  /// An endpoint of the session's bus, see BaseStationOptions.
  std::function<Result<std::unique_ptr<Bus>>()> open_bus;
  std::string session;  ///< path of the session log; notes are stored beside it
  std::string cloud;    ///< file with the cloud that the model was built from; empty: none
  std::shared_ptr<const SiteTexture> texture;  ///< what the site looks like; null: it was not recorded
  std::vector<std::string> stopped_robots;  ///< emergency stops of an earlier server process that are active
};

/// The report and the after-action pages of a session, for BaseStation::set_report; pages are empty where its
/// log cannot be read.
station::SessionReport session_report(const runtime::Report& report, const std::string& log);

class LiveStation {
 public:
  static Result<std::unique_ptr<LiveStation>> open(const LiveStationOptions& options,
                                                   const tick::Configuration& configuration);

  /// For people: link, fingerprint, first account.
  std::string invitation() const { return station_->invitation(); }
  /// For serve(): lets an instructor pause it. None: the robot is real.
  std::shared_ptr<const runtime::SessionClock> clock() const { return clock_; }
  /// True after an instructor has ended the session.
  bool ended() const { return ended_; }
  /// Call when the session has ended: nobody drives from a page any more.
  void end_driving() { station_->end_driving(); }
  /// Call after the session has ended: publishes its report and its review, for which the log is read again.
  void show_report(const runtime::Report& report);

 private:
  std::string log_;
  std::atomic<bool> ended_ = false, reported_ = false;
  std::shared_ptr<runtime::SessionClock> clock_;
  std::unique_ptr<station::BaseStation> station_;
};

}  // namespace parhelion::tools
