// Length of a line within a box.
#pragma once

#include "protocols/frames.hpp"

namespace parhelion {

/// m of the line from a to b within a box of full lengths `size` at T_map_body (Kay and Kajiya's slabs,
/// SIGGRAPH 1986); 0: it misses the box.
double line_in_box(const Transform<Map, Body>& T_map_body, const Eigen::Vector3d& size,
                   const Eigen::Vector3d& a, const Eigen::Vector3d& b);

}  // namespace parhelion
