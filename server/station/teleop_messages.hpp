// Messages on /ws/teleop: validated requests of pages, and messages to pages. Each is a JSON object with
// "type".
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/pose.hpp"
#include "protocols/status.hpp"
#include "server/station/console/operator_console.hpp"
#include "server/station/dead_man_gate.hpp"

namespace parhelion::station {

struct TeleopJoint {
  std::string name;
  std::string kind;             ///< "revolute", "continuous" or "prismatic"
  double lower = 0, upper = 0;  ///< rad or m; equal: unbounded
  double speed = 0;             ///< rad/s or m/s, maximum command
};

/// A robot, and how pages can drive it.
struct TeleopRobot {
  DrivenRobot driven;
  double vx = 1, vy = 0, wz = 1.5;  ///< m/s and rad/s, maximum commands; 0: no motion in this direction
  std::vector<TeleopJoint> joints;
  bool video = false;        ///< has a camera
  std::string why_not;       ///< reason, for people, why nobody can drive it; empty: pages can
  bool for_trainees = true;  ///< trainees may drive it; of other robots they learn nothing here
};

struct TeleopRequest {
  enum class Kind : std::uint8_t {
    drive,    ///< `robot`
    twist,    ///< `stamp`, `twist`: the dead-man is held
    release,  ///< the dead-man was released
    joints,   ///< `stamp`, `names`, `velocities`: held
    stop,     ///< emergency stop
    ping,  ///< `stamp.at`; `pong_us`, `pong_received_at`: a reply of the server, and when the page received
           ///< it
  };
  Kind kind = Kind::release;
  std::string robot;
  ClientStamp stamp;
  Twist2 twist;  ///< m/s, rad/s
  std::vector<std::string> names;
  std::vector<double> velocities;  ///< rad/s or m/s, as many as names
  std::optional<std::int64_t> pong_us;
  Duration pong_received_at;
};

/// Error: not JSON, over 4 KiB, an unknown or missing type or key, a number that is not one or not finite,
/// lists of different length. It contains the key and what was expected.
Result<TeleopRequest> read_teleop_request(std::string_view text);

/// Which operator drives which robot.
struct Driving {
  std::string robot, by;
};
/// An active emergency stop.
struct EmergencyStop {
  std::string robot, by;
};

std::string robots_text(const std::vector<TeleopRobot>& robots);
/// `by` empty: nobody. `you`: the addressed page drives. `silent`: released only because the page was silent.
std::string driven_text(const std::string& robot, const std::string& by, bool you, bool silent = false);
std::string sent_text(const ClientStamp& stamp);
/// `rearm`: the dead-man has to be released before anything moves.
std::string refused_text(const std::string& why, bool rearm);
std::string estop_text(const std::string& robot, const std::string& by, bool on);
/// `server_us`: the server's clock, microseconds.
std::string pong_text(Duration at, std::int64_t server_us);

}  // namespace parhelion::station
