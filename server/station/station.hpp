// The base station: a bus client beside the server that shows the session on pages and sends their requests
// to the bus. The tick does not depend on it.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "protocols/bus/bus.hpp"
#include "protocols/site_texture.hpp"
#include "server/station/http/http_server.hpp"
#include "server/station/http/metrics_text.hpp"
#include "server/station/instructor_service.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::station {

/// A picture of the map that the robot localizes in.
struct StationMap {
  std::string png;
  double resolution = 0.05;                          ///< m a pixel
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< m, map: lower left corner
};

/// The report of a session; empty: there is none. Trainees get their own, without what was not sensed.
struct SessionReport {
  std::string json, page;
  std::string trainees_json, trainees_page;
  struct Pages {
    std::string page, trainees_page;
  };
  std::map<std::string, Pages, std::less<>> of_robots;  ///< of several, by name
};

struct StationOptions {
  std::shared_ptr<const tick::Configuration> configuration;
  bool recorded = false;  ///< the bus plays a recording
  SessionControls controls;
  StopHook emergency_stop;
  std::function<bool()> stopped;       ///< an emergency stop is active; empty: not available
  std::function<ArrivalTime()> clock;  ///< the server's clock; empty: wall time
  std::string notes;                   ///< file that chat and marks are appended to; empty: none
  std::string scenarios;               ///< folder for saved scenarios; empty: saving is disabled
  std::optional<StationMap> map;
  std::string cloud;  ///< binary message 3: points of the site, map frame; empty: none
  std::shared_ptr<const SiteTexture> texture;  ///< what the site looks like; null: it was not recorded
  AuditHook audit;                             ///< called on the station's thread
};

class Station {
 public:
  /// Adds its routes to `server`, which must not run yet, and subscribes to the bus. MR_SESSION begins a
  /// session, another one starts a new one. Error: a channel cannot be subscribed to, or the notes cannot be
  /// written.
  static Result<std::unique_ptr<Station>> open(std::unique_ptr<Bus> bus, HttpServer& server,
                                               StationOptions options);
  /// Destroy after the server, whose handlers refer to the station.
  ~Station();
  Station(const Station&) = delete;
  Station& operator=(const Station&) = delete;

  /// After the session has ended, for /api/v1/report and /report (of one of several robots: /report?NAME).
  /// Thread-safe.
  void set_report(SessionReport report);
  /// Metrics of MR_STATUS, and the number of pages. Thread-safe.
  void add_metrics(MetricsText& text);

 private:
  struct Running;
  explicit Station(std::unique_ptr<Running> running);
  std::unique_ptr<Running> running_;
};

}  // namespace parhelion::station
