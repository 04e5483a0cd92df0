// The triangles of a model's meshes as the renderer takes them: cut into chunks that are culled one by one.
// Private to this room.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "protocols/model.hpp"
#include "render/mesh.hpp"

namespace parhelion::render {

/// A run of vertices (three a triangle) and the box around them, map frame, m.
struct MeshChunk {
  Eigen::AlignedBox3d box;
  std::uint32_t first = 0, count = 0;
};

struct BuildingMesh {
  std::vector<MeshVertex> vertices;  ///< core: position in the map, m; direction: the triangle's normal
  std::vector<MeshChunk> chunks;
};

/// Each triangle twice, once from either side: thin surfaces hide and are seen from both. Triangles that name
/// a vertex that is not there, or have no area, are left out.
BuildingMesh building_mesh(const SemanticModel& model);

}  // namespace parhelion::render
