// The live server: inbox, tick, outbox, guard and render thread, until stopped.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/status.hpp"
#include "server/runtime/inbox.hpp"
#include "server/runtime/refused_hosts.hpp"
#include "server/runtime/refused_messages.hpp"
#include "server/runtime/report.hpp"
#include "server/runtime/site_mapper.hpp"
#include "server/runtime/thread_priority.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::runtime {

/// What stops a real robot: messages for whoever outlives the server.
struct RobotStop {
  std::string command_channel;      ///< of a TwistCommand of zero
  std::string joint_channel;        ///< of Joints with velocity zero
  std::vector<std::string> joints;  ///< commanded so far
  bool operator==(const RobotStop&) const = default;
};

struct ServeOptions {
  std::string session;  ///< path of the session log
  bool overwrite = false;
  Duration guard = milliseconds(20);
  InboxLimits inbox;
  RealTime real_time =
      RealTime::off;  ///< for the threads that scans wait for: receiving, the tick, the guard
  std::shared_ptr<const SessionClock> clock;  ///< none: real time. Only with a simulated robot
  UpdateSite update_site;                     ///< for scenarios with mapping: true; empty: no mapping
  /// The previous server ended during an emergency stop: the stop applies from the start.
  bool robot_stopped = false;
  /// Called on each change of the emergency stop, before anything else; may be empty. The stored value
  /// outlives a server that crashes.
  std::function<void(bool)> robot_stop_held;
  std::function<void()> begun;            ///< called when the session and its log exist; may be empty
  bool open_bus = false;                  ///< other machines can send messages, and nothing is signed
  RefusedMessages* refused = nullptr;     ///< of a bus with signatures; none: nothing is refused
  RefusedHosts* refused_hosts = nullptr;  ///< may be none
  /// Called when a real robot is commanded for the first time, and when further joints are; may be empty.
  std::function<void(const RobotStop&)> commanded;
  /// Called by the loop in each round, at least ten times a second: never while the loop hangs. May be empty.
  std::function<void()> loop_runs;
  /// Called when the loop has ended, before what was received until then is processed; may be empty.
  std::function<void()> loop_ended;
  std::function<bool()> stop;                      ///< polled at least ten times a second
  std::function<void(const std::string&)> notify;  ///< messages for people: started, waiting, degraded
};

/// Subscribes, waits for the robot description if the configuration has none, serves, and reports. Error: the
/// transport fails, or the session log cannot be created.
Result<Report> serve(Bus& bus, const tick::Configuration& configuration, const ServeOptions& options);

/// The robot description from the ROBOT channel; nullopt: stopped before it arrived. One that cannot be read
/// is reported, and waiting goes on.
Result<std::optional<RobotDescription>> wait_for_robot(Bus& bus, const Scenario& scenario,
                                                       const ServeOptions& options);

}  // namespace parhelion::runtime
