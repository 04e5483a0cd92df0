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
  float range_max = 0;    ///< m, from the line; 0: no such field in this kind of line
  std::string statement;  ///< type, maximum, accuracy, remission mode, from the line
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

/// A line of an unsupported kind, or a comment (kind "#").
struct CarmenOther {
  std::string kind;
};

using CarmenLine = std::variant<CarmenLaser, CarmenOdometry, CarmenTruePose, CarmenParameter, CarmenOther>;

/// FLASER and RLASER contain no angles: beams start at -90 degrees and go counter-clockwise, 180 and 181
/// beams at 1 degree, 360 and 361 at half a degree and so on. Stamp: ipc_timestamp, when the laser's driver
/// sent the whole scan. The error contains what was expected and found; the caller adds file and line.
/// `damaged`: becomes true if the line has fewer or more words than its kind, as one that was cut off or runs
/// into the next.
Result<CarmenLine> parse_carmen_line(std::string_view line, bool& damaged);

/// Whether the last line of a file, which has no line break, ends inside the name of its kind: "ROBOTLAS".
bool is_cut_carmen_kind(std::string_view line);

}  // namespace parhelion::tools
