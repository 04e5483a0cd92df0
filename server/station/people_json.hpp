// Message to pages: what is known of the real people beside their poses.
#pragma once

#include <string>

#include "protocols/codec.hpp"

namespace parhelion::station {

/// {"type": "people", "list": [{"name", "velocity": [vx, vy] in m/s, "radius": m, "ellipse": [major, minor,
/// yaw], 1 sigma of the place in m and rad}]}; `velocity` and `ellipse` in map. People who have no body in
/// `world` are left out.
std::string people_json(const WorldMessage& world);

}  // namespace parhelion::station
