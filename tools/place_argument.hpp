// A place on the command line: "2.5,1,90deg".
#pragma once

#include <Eigen/Core>
#include <string>

#include "protocols/status.hpp"

namespace parhelion::tools {

/// How help texts describe it.
inline constexpr const char* place_format = "X,Y,YAW in the map, such as 2.5,1,90deg or 250cm,1m,1.57rad";

/// "X,Y" or "X,Y,YAW" as x and y (m) and yaw (rad, 0 where it is not given). Lengths are metres unless they
/// carry another unit; a yaw other than 0 must carry its unit, since both degrees and radians would be
/// believed. `with_yaw`: X,Y alone is not enough. The error says which part is wrong and what was expected.
Result<Eigen::Vector3d> parse_place(const std::string& text, bool with_yaw);

/// "X,Y" in metres or with units.
Result<Eigen::Vector2d> parse_point(const std::string& text);

/// "X,Y,Z" lengths in metres or with units.
Result<Eigen::Vector3d> parse_lengths(const std::string& text);

}  // namespace parhelion::tools
