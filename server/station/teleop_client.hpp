// One driving page: the robot that it drives, and whether it may move that robot now.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "server/station/console/operator_console.hpp"
#include "server/station/dead_man_gate.hpp"
#include "server/station/http/web_client.hpp"
#include "server/station/teleop_messages.hpp"

namespace parhelion::station {

/// The same instant on the steady clock and as a stamp of bus messages.
struct TeleopInstant {
  WallTime steady;
  SensorTime stamp;
};

/// Not thread-safe. If a Status is an Error, the robot has been stopped, and the text is for the page.
class TeleopClient {
 public:
  TeleopClient(Bus& bus, std::shared_ptr<WebClient> client, WallTime now);

  WebClient& client() { return *client_; }
  const WebClient& client() const { return *client_; }
  const std::string& who() const { return client_->who().name; }
  /// Empty: drives no robot.
  const std::string& robot() const { return robot_.driven.name; }
  bool must_rearm() const { return wheels_.must_rearm(); }
  void send(const std::string& text) { client_->send(std::make_shared<const std::string>(text), false); }

  void set_robots(const std::vector<TeleopRobot>& robots);
  /// Stops the previous robot. The dead-man has to be released before the new one moves.
  Status drive(const TeleopRobot& robot, TeleopInstant now);
  /// The dead-man is held: m/s and rad/s, scaled as a whole to the robot's limits. False: not sent, out of
  /// order.
  Result<bool> move(const ClientStamp& stamp, const Twist2& twist, TeleopInstant now);
  Result<bool> move_joints(const TeleopRequest& request, TeleopInstant now);
  /// The dead-man was released.
  Status release(TeleopInstant now);
  /// Like release(), and the dead-man has to be released before anything moves again.
  Status halt(TeleopInstant now);
  /// Releases control of its robot. `lost`: not requested by the operator.
  Status release_control(bool lost, const std::string& why, TeleopInstant now);

  void note_message(WallTime now) { last_message_ = now; }
  ClientClock& clock() { return clock_; }
  /// Periodic work: repeats stops, reports who drives. Error: the page is silent, or lost its robot.
  Status watch(TeleopInstant now);
  /// Counts a malformed message; true: too many.
  bool is_too_faulty() { return ++faults_ >= 20; }
  /// Counts a message; true: above the rate limit.
  bool is_too_fast(WallTime now);

 private:
  Status pass(DeadManGate& gate, const ClientStamp& stamp, TeleopInstant now, bool& passed);
  Status send_stop(TeleopInstant now);

  std::shared_ptr<WebClient> client_;
  OperatorConsole console_;
  TeleopRobot robot_;
  ClientClock clock_;
  DeadManGate wheels_, arm_;
  std::vector<std::string> moved_joints_;  // not stopped since
  WallTime last_message_, stop_until_, stop_sent_;
  WallTime counted_from_;
  int counted_ = 0, faults_ = 0;
};

}  // namespace parhelion::station
