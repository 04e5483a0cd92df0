// What is said on /ws/teleop: what a page asks, checked, and what it is told; each a JSON object with "type".
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
  double lower = 0, upper = 0;  ///< rad or m; equal: no bounds
  double speed = 0;             ///< rad/s or m/s, what may be asked for at most
};

/// A robot, and how pages can drive it.
struct TeleopRobot {
  DrivenRobot driven;
  double vx = 1, vy = 0, wz = 1.5;  ///< m/s and rad/s, what may be asked for at most; 0: not at all
  std::vector<TeleopJoint> joints;
  bool video = false;   ///< has a camera
  std::string why_not;  ///< why nobody can drive it, for people; empty: pages can
};

struct TeleopRequest {
  enum class Kind : std::uint8_t {
    drive,    ///< `robot`
    twist,    ///< `stamp`, `twist`: the dead-man is held
    release,  ///< the dead-man is let go
    joints,   ///< `stamp`, `names`, `velocities`: held
    stop,     ///< emergency stop
    ping,     ///< `stamp.at`; `heard`, `heard_at`: an answer of ours, and when the page had it
  };
  Kind kind = Kind::release;
  std::string robot;
  PageStamp stamp;
  Twist2 twist;  ///< m/s, rad/s
  std::vector<std::string> names;
  std::vector<double> velocities;  ///< rad/s or m/s, as many as names
  std::optional<std::int64_t> heard_us;
  Duration heard_at;
};

/// Error: not JSON, over 4 KiB, a type or key that does not exist, one that is missing, a number that is none
/// or not finite, lists of different length; it names the key and what was expected.
Result<TeleopRequest> read_teleop_request(std::string_view text);

/// Who drives what.
struct Driving {
  std::string robot, by;
};
/// An emergency stop that holds.
struct EmergencyStop {
  std::string robot, by;
};

std::string robots_text(const std::vector<TeleopRobot>& robots);
/// `by` empty: nobody any more. `you`: it is the page that is told. `silent`: it was let go of for silence
/// alone.
std::string driven_text(const std::string& robot, const std::string& by, bool you, bool silent = false);
std::string sent_text(const PageStamp& stamp);
/// `rearm`: the dead-man has to be let go before anything moves.
std::string refused_text(const std::string& why, bool rearm);
std::string estop_text(const std::string& robot, const std::string& by, bool on);
/// `server_us`: the server's clock, microseconds.
std::string pong_text(Duration at, std::int64_t server_us);

}  // namespace parhelion::station
