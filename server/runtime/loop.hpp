// The live server: inbox, tick, outbox, guard and render thread, until stopped.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/site_texture.hpp"
#include "protocols/status.hpp"
#include "protocols/twist_command.hpp"
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
  std::string command_channel;  ///< of a TwistCommand of zero
  CommandType command_type = CommandType::twist;
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
  std::shared_ptr<const SiteTexture> texture;  ///< how simulated cameras show the site; may be null
  std::shared_ptr<const SessionClock> clock;   ///< none: real time. Only with a simulated robot
  UpdateSite update_site;                      ///< for scenarios with mapping: true; empty: no mapping
  /// Names of the robots whose emergency stop was active when the previous server ended: it applies from the
  /// start.
  std::vector<std::string> stopped_robots;
  /// Called on each change of a robot's emergency stop, before anything else; may be empty. The stored value
  /// outlives a server that crashes.
  std::function<void(const std::string& robot, bool)> robot_stop_held;
  std::function<void()> begun;            ///< called when the session and its log exist; may be empty
  bool open_bus = false;                  ///< other machines can send messages, and nothing is signed
  RefusedMessages* refused = nullptr;     ///< of a bus with signatures; none: nothing is refused
  RefusedHosts* refused_hosts = nullptr;  ///< may be none
  /// Called with the stops of all commanded real robots, when one is commanded for the first time and when
  /// further joints are; may be empty.
  std::function<void(const std::vector<RobotStop>&)> commanded;
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

/// The descriptions of the scenario's robots, in its order: those of `known`, the others from their ROBOT
/// channels. nullopt: stopped before they arrived. One that cannot be read is reported, and waiting goes on;
/// so it does for a robot that does not come, which is reported every ten seconds.
Result<std::optional<std::vector<RobotDescription>>> wait_for_robots(
    Bus& bus, const Scenario& scenario, std::vector<std::optional<RobotDescription>> known,
    const ServeOptions& options);

}  // namespace parhelion::runtime
