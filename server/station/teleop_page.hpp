// One page that drives: what it drives, and whether it may move that now.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "server/station/console/operator_console.hpp"
#include "server/station/dead_man_gate.hpp"
#include "server/station/http/web_client.hpp"
#include "server/station/teleop_words.hpp"

namespace parhelion::station {

/// The same instant on the steady clock and as messages on the bus say it.
struct TeleopInstant {
  WallTime steady;
  SensorTime stamp;
};

/// Not thread-safe. Where a Status is an Error the robot has been stopped, and the text is for the page.
class TeleopPage {
 public:
  TeleopPage(Bus& bus, std::shared_ptr<WebClient> client, WallTime now);

  WebClient& client() { return *client_; }
  const std::string& who() const { return client_->who().name; }
  /// Empty: it drives none.
  const std::string& robot() const { return robot_.driven.name; }
  bool must_rearm() const { return wheels_.must_rearm(); }
  void tell(const std::string& text) { client_->send(std::make_shared<const std::string>(text), false); }

  void set_robots(const std::vector<TeleopRobot>& robots);
  /// Stops the one before. The dead-man has to be let go before this one moves.
  Status drive(const TeleopRobot& robot, TeleopInstant now);
  /// The dead-man is held: m/s and rad/s, scaled as a whole to what the robot may do. False: not sent, as it
  /// came out of order.
  Result<bool> move(const PageStamp& stamp, const Twist2& twist, TeleopInstant now);
  Result<bool> move_joints(const TeleopRequest& request, TeleopInstant now);
  /// The dead-man is let go.
  Status release(TeleopInstant now);
  /// As if it were let go, and it has to be let go before anything moves again.
  Status halt(TeleopInstant now);
  /// Drives nothing any more. `lost`: not by the operator's will.
  Status let_go(bool lost, const std::string& why, TeleopInstant now);

  void heard(WallTime now) { heard_ = now; }
  PageClock& clock() { return clock_; }
  /// What is due: stops that are said again, who drives. Error: it fell silent, or is lost and drives no
  /// more.
  Status watch(TeleopInstant now);
  /// Counts a message that could not be read; true: too many.
  bool is_too_faulty() { return ++faults_ >= 20; }
  /// Counts a message; true: more come than a page has to say.
  bool is_too_fast(WallTime now);

 private:
  Status pass(DeadManGate& gate, const PageStamp& stamp, TeleopInstant now, bool& passed);
  Status say_stop(TeleopInstant now);

  std::shared_ptr<WebClient> client_;
  OperatorConsole console_;
  TeleopRobot robot_;
  PageClock clock_;
  DeadManGate wheels_, arm_;
  std::vector<std::string> moved_joints_;  // not stopped since
  WallTime heard_, stop_until_, stop_said_;
  WallTime counted_from_;
  int counted_ = 0, faults_ = 0;
};

}  // namespace parhelion::station
