// The base station: a client of the bus beside the server, which shows pages what is there and sends on what
// they ask for. The tick knows nothing of it.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "protocols/bus/bus.hpp"
#include "server/station/http/http_server.hpp"
#include "server/station/http/metrics_text.hpp"
#include "server/station/instructor_desk.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::station {

/// A picture of the map that the robot localizes in.
struct StationMap {
  std::string png;
  double resolution = 0.05;                          ///< m a pixel
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< m, map: lower left corner
};

struct StationOptions {
  std::shared_ptr<const tick::Configuration> configuration;
  bool recorded = false;  ///< what is on the bus is played from a log
  SessionControls controls;
  StopHook emergency_stop;
  std::function<bool()> stopped;       ///< an emergency stop holds; empty: there is none
  std::function<ArrivalTime()> clock;  ///< the server's clock now; empty: wall time
  std::string notes;                   ///< file that chat and marks are appended to; empty: none
  std::string scenarios;               ///< folder of scenarios that instructors save; empty: none are
  std::optional<StationMap> map;
  std::string cloud;  ///< binary message 3: points of the site, map frame; empty: none
  DeskAudit audit;    ///< called on the station's thread
};

class Station {
 public:
  /// Puts its routes on `server`, which must not run yet, and begins to listen. MR_SESSION begins a session,
  /// and another one begins it anew. Error: a channel cannot be subscribed to, or the notes not be written.
  static Result<std::unique_ptr<Station>> open(std::unique_ptr<Bus> bus, HttpServer& server,
                                               StationOptions options);
  /// After the server: its handlers know the station.
  ~Station();
  Station(const Station&) = delete;
  Station& operator=(const Station&) = delete;

  /// After the end, for /api/v1/report and /report; `page` may be empty. Thread-safe.
  void set_report(std::string json, std::string page);
  /// Figures of MR_STATUS, and how many pages look. Thread-safe.
  void add_metrics(MetricsText& text);

 private:
  struct Running;
  explicit Station(std::unique_ptr<Running> running);
  std::unique_ptr<Running> running_;
};

}  // namespace parhelion::station
