// A body with its origin at its robot's base_link (agents, the real robot, the first part of an articulated
// robot): its pose in either frame.
#pragma once

#include "protocols/frames.hpp"

namespace parhelion::simulation {

inline Transform<Map, Base> base_of(const Transform<Map, Body>& T_map_body) {
  return Transform<Map, Base>(T_map_body.isometry());
}

inline Transform<Map, Body> body_of(const Transform<Map, Base>& T_map_base) {
  return Transform<Map, Body>(T_map_base.isometry());
}

}  // namespace parhelion::simulation
