// /ws/teleop: pages drive robots, one operator per robot at a time, and stop them. Fail-safe: a page that is
// silent, late, disconnected, malformed or replaced loses control, and its robot is stopped.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/event.hpp"
#include "protocols/instructor_command.hpp"
#include "server/station/http/web_client.hpp"
#include "server/station/teleop_client.hpp"
#include "server/station/teleop_messages.hpp"

namespace parhelion::station {

struct TeleopOptions {
  std::function<WallTime()> now;      ///< steady
  std::function<SensorTime()> stamp;  ///< stamps of bus messages: the wall clock
  /// Audit: actor and action. These two may be empty. They are called with the service locked and must not
  /// call it.
  std::function<void(const std::string& who, const std::string& what)> audit;
  std::function<void(const std::vector<EmergencyStop>&)> stops_changed;
  std::string emergency_stops = channel::kMrEmergencyStop;  ///< channel on the bus
  std::vector<std::string> robots = {};          ///< the trainees', which others may also stop and release
  std::vector<EmergencyStop> active_stops = {};  ///< active at the start: of an earlier server process
};

/// Thread-safe: the web server's thread delivers messages of pages, the station's thread the rest. If one of
/// them hangs, the other still stops the robots. If both hang, the tick does so after 0.5 s without commands.
class TeleopService {
 public:
  /// `bus` is used only to publish, and outlives the service.
  TeleopService(Bus& bus, TeleopOptions options);
  /// Stops all driven robots.
  ~TeleopService();
  TeleopService(const TeleopService&) = delete;
  TeleopService& operator=(const TeleopService&) = delete;

  /// The service must outlive the server.
  SocketHandler socket();

  /// Robots that exist now. Control of a robot that no longer exists is released.
  void set_robots(std::vector<TeleopRobot> robots);
  /// Status of another console on the bus, which may drive, too.
  void handle(const OperatorStatus& status);
  /// Request to the server from any console: others stop the robot and release stops, too.
  void handle(const EmergencyStopCommand& command);
  /// The server's reply: an emergency stop is requested until it is confirmed.
  void handle(const Event& event);
  /// At least every 50 ms: handles silent pages, repeats stops, reports who drives.
  void turn();

  /// Active until release_stop(): the server is requested to stop the robot, whoever drives it, no command of
  /// a page for it is sent, and the request is repeated until the server has replied. `robot` empty: all.
  /// Idempotent. Error: no such robot, or the bus.
  Status stop(const std::string& robot, const std::string& by);
  /// `robot` empty: all. The caller checks the permission of `by`. Nothing moves before the dead-man was
  /// released.
  Status release_stop(const std::string& robot, const std::string& by);
  /// The same for stops that `by` has pressed. Error, and nothing is released: somebody else pressed one of
  /// them, or none is active.
  Status release_own_stop(const std::string& robot, const std::string& by);
  std::vector<EmergencyStop> stops() const;
  std::vector<Driving> driving() const;
  /// Stops all driven robots, and nobody drives any more: there is no server that would reduce commands.
  void end_session();

 private:
  /// An emergency stop or its release, sent to the server until it replies.
  struct StopRequest {
    bool stop = true;
    std::string stopped_by;  ///< of a release: who had pressed the stop
    std::uint64_t number = 0;
    WallTime sent;
    int times = 0;
    bool answered = false;
  };
  struct OtherConsole {
    std::string robot;
    WallTime last_status;
  };

  void opened(std::shared_ptr<WebClient> client);
  void received(WebClient& client, std::string_view bytes, bool binary);
  void closed(WebClient& client);

  Status act(TeleopClient& teleop_client, const TeleopRequest& request);
  Status drive(TeleopClient& teleop_client, const std::string& robot);
  Status move(TeleopClient& teleop_client, const TeleopRequest& request);
  void reply_to_ping(TeleopClient& teleop_client, const TeleopRequest& request);
  std::vector<std::string> names_to_stop(const std::string& robot) const;
  Status stop_locked(const std::string& robot, const std::string& by);
  Status release_locked(const std::string& robot, const std::string& by);
  void apply_emergency_stop(const std::string& robot, bool stop);
  bool is_trainees(const std::string& robot) const;
  Status send_stop(const TeleopRobot& robot);
  Status send_stop_request(const std::string& robot, StopRequest& request);
  void stop_again(const std::string& robot);
  void repeat_stop_requests(WallTime now);
  std::uint64_t next_request();
  void refuse(TeleopClient& teleop_client, const Status& why);
  void release_control(TeleopClient& teleop_client, bool lost, const std::string& why);
  /// The client that must release the robot before `teleop_client` may drive it, or nullptr. Error: it may
  /// not drive it.
  Result<TeleopClient*> client_to_replace(const TeleopClient& teleop_client, const std::string& robot) const;
  const TeleopRobot* find(const std::string& robot) const;
  /// True if the page may learn of the robot.
  bool is_for(const TeleopClient& teleop_client, const std::string& robot) const;
  std::vector<TeleopRobot> robots_for(const TeleopClient& teleop_client) const;
  /// To the pages that may learn of the robot.
  void send_about(const std::string& robot, const std::string& text);
  /// `silent`: its page was silent, and may take control again.
  void send_driver(const std::string& robot, bool silent = false);
  void audit(const std::string& who, const std::string& what) const;
  TeleopInstant now() const { return {options_.now(), options_.stamp()}; }
  std::vector<EmergencyStop> active_stops() const;

  Bus& bus_;
  const TeleopOptions options_;
  mutable std::mutex mutex_;
  std::vector<TeleopRobot> robots_;
  bool ended_ = false;                                                ///< the session
  std::map<std::uint64_t, std::unique_ptr<TeleopClient>> clients_;    // by client
  std::map<std::string, std::string> stopped_by_;                     // by robot: who stopped it
  std::map<std::string, StopRequest> stop_requests_;                  // by robot: the last
  std::map<std::uint64_t, EmergencyStopCommand> requests_of_others_;  // by request
  std::set<std::uint64_t> own_requests_;                              // our own newest requests
  std::uint64_t requests_ = 0;
  std::map<std::string, OtherConsole>
      other_consoles_;  // by operator: driving consoles other than this service
  std::vector<std::uint8_t> payload_;
};

}  // namespace parhelion::station
