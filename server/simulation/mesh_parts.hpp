// A model's mesh for what is computed in the plane: small convex pieces with a bottom and a top.
#pragma once

#include <vector>

#include "protocols/model.hpp"
#include "server/simulation/planar.hpp"

namespace parhelion::simulation {

struct MeshPart {
  Footprint footprint;
  double bottom = 0, top = 0;  ///< m, z
};

/// m: in each cube with sides of this length the mesh's surface is replaced by the hull of its projection.
/// What it adds to the mesh is less than a cube.
inline constexpr double kMeshCell = 0.25;

/// Ascending by cube (z, y, x). A mesh of so many or such large triangles that more than `most_pieces` would
/// be cut gets larger cubes. The mesh has passed check_mesh().
std::vector<MeshPart> mesh_parts(const ModelMesh& mesh, std::size_t most_pieces = 2'000'000);

}  // namespace parhelion::simulation
