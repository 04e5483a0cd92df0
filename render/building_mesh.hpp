// The triangles of a model's meshes for the renderer, cut into chunks that are culled individually. Private
// to this module.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "protocols/model.hpp"
#include "render/mesh.hpp"

namespace parhelion::render {

/// A range of vertices (three per triangle) and their bounding box, map frame, m.
struct MeshChunk {
  Eigen::AlignedBox3d box;
  std::uint32_t first = 0, count = 0;
};

struct BuildingMesh {
  /// MeshVertex::core is the position in the map frame, m; MeshVertex::direction is the triangle's normal.
  std::vector<MeshVertex> vertices;
  std::vector<MeshChunk> chunks;
};

/// Each triangle twice, once per side: thin surfaces occlude and are visible from both. Triangles with an
/// invalid vertex index or no area are dropped.
BuildingMesh building_mesh(const SemanticModel& model);

}  // namespace parhelion::render
