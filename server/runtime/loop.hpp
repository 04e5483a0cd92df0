// The live server: inbox, tick, outbox, guard and render thread, until it is told to stop.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "protocols/bus/bus.hpp"
#include "protocols/status.hpp"
#include "server/runtime/inbox.hpp"
#include "server/runtime/report.hpp"
#include "server/runtime/site_mapper.hpp"
#include "server/runtime/thread_priority.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::runtime {

struct ServeOptions {
  std::string session;  ///< path of the session log
  bool overwrite = false;
  Duration guard = milliseconds(20);
  InboxLimits inbox;
  RealTime real_time = RealTime::off;         ///< what scans wait for: receiving, the tick, the guard
  std::shared_ptr<const SessionClock> clock;  ///< none: real time. Only where the robot is simulated
  UpdateSite update_site;                     ///< where the scenario says mapping: true; empty: none is done
  /// The robot's emergency stop held when the server before this one died: it holds from the start.
  bool robot_stopped = false;
  /// Told of each change of that, before anybody else is; may be empty. What it keeps outlives a server that
  /// dies.
  std::function<void(bool)> robot_stop_held;
  std::function<bool()> stop;                   ///< asked at least ten times a second
  std::function<void(const std::string&)> say;  ///< news for a person: started, waiting, degraded
};

/// Subscribes, waits for the robot description where the configuration has none yet, serves, and reports.
/// Error: the transport fails, or the session log cannot be made.
Result<Report> serve(Bus& bus, const tick::Configuration& configuration, const ServeOptions& options);

/// The robot description from the ROBOT channel; nullopt: told to stop before it came.
Result<std::optional<RobotDescription>> wait_for_robot(Bus& bus, const Scenario& scenario,
                                                       const ServeOptions& options);

}  // namespace parhelion::runtime
