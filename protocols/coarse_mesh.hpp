// A mesh with fewer triangles, for people to look at.
#pragma once

#include <cstddef>
#include <vector>

#include "protocols/shape_mesh.hpp"

namespace parhelion {

struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;  ///< m, shape frame
  std::vector<MeshTriangle> triangles;    ///< indices of vertices, counter-clockwise from outside
};

/// The mesh itself if it has at most `max_triangles`. Else vertices of one cell of a grid become their mean;
/// the cells are as small as that allows.
TriangleMesh coarse_mesh(const ShapeMesh& mesh, std::size_t max_triangles);

}  // namespace parhelion
