// One line of a CARMEN log. Format: CARMEN's logger (log.c, "message_name [contents] ipc_timestamp host
// logger_timestamp").
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "protocols/frames.hpp"
#include "protocols/pose.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"

namespace parhelion::tools {

struct CarmenLaser {
  std::string kind;  ///< "FLASER", "RLASER", "ROBOTLASER1", ...
  Scan scan;
  Transform<Odom, Base> T_odom_base;
  Transform<Odom, Laser> T_odom_laser;
  float range_max = 0;    ///< m, as the line states it; 0: the kind of line has no such field
  std::string statement;  ///< type, maximum, accuracy, remission mode, as the line states them
};

struct CarmenOdometry {
  Odometry odometry;
};

struct CarmenTruePose {
  PoseStamped pose;  ///< of the simulator, planar
};

struct CarmenParameter {
  std::string name, value;
};

/// A line of a kind that is not read, or a comment (kind "#").
struct CarmenOther {
  std::string kind;
};

using CarmenLine = std::variant<CarmenLaser, CarmenOdometry, CarmenTruePose, CarmenParameter, CarmenOther>;

/// FLASER and RLASER carry no angles: from -90 degrees counter-clockwise, 180 and 181 beams of 1 degree, 360
/// and 361 of half a degree and so on. Stamp: ipc_timestamp, when the laser's driver sent the whole scan. An
/// Error says what was expected and found; the caller knows file and line.
Result<CarmenLine> parse_carmen_line(std::string_view line);

}  // namespace parhelion::tools
