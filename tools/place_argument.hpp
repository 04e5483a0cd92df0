// A pose on the command line: "2.5,1,90deg".
#pragma once

#include <Eigen/Core>
#include <string>

#include "protocols/status.hpp"

namespace parhelion::tools {

/// Its format in help texts.
inline constexpr const char* kPlaceFormat = "X,Y,YAW in the map, such as 2.5,1,90deg or 250cm,1m,1.57rad";

/// "X,Y" or "X,Y,YAW" as x and y (m) and yaw (rad, default 0). Lengths are metres unless they have another
/// unit. A yaw other than 0 needs a unit, since degrees and radians are both plausible. `with_yaw`: X,Y alone
/// is an error. The error contains the wrong part and what was expected.
Result<Eigen::Vector3d> parse_place(const std::string& text, bool with_yaw);

/// "X,Y" in metres or with units.
Result<Eigen::Vector2d> parse_point(const std::string& text);

/// "X,Y,Z" lengths in metres or with units.
Result<Eigen::Vector3d> parse_lengths(const std::string& text);

}  // namespace parhelion::tools
