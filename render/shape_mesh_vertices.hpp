// The vertices of a shape's mesh as they are drawn.
#pragma once

#include <vector>

#include "protocols/shape_mesh.hpp"
#include "render/mesh.hpp"

namespace parhelion::render {

/// Three for each triangle; core in m (scale 1, bevel 0). The normals of faces that meet at a vertex at less
/// than 40 degrees are averaged there, so that round parts look round and edges sharp.
std::vector<MeshVertex> shape_mesh_vertices(const ShapeMesh& mesh);

}  // namespace parhelion::render
