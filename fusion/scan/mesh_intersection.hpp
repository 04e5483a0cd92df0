// Distance along a line to a mesh, through its tree.
#pragma once

#include <Eigen/Core>

#include "protocols/shape_mesh.hpp"

namespace parhelion::scan {

/// m to the first triangle along the line, hit from either side; +inf: none. Unlike the other shapes a mesh
/// is a surface, not a solid: a line that starts inside meets it from within. `origin`: m, shape frame;
/// `direction`: unit length.
double mesh_range(const ShapeMesh& mesh, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

}  // namespace parhelion::scan
