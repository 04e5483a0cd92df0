// A model's mesh for planar computations: small convex pieces with a bottom and a top.
#pragma once

#include <vector>

#include "protocols/model.hpp"
#include "server/simulation/building/planar.hpp"

namespace parhelion::simulation {

struct MeshPiece {
  Footprint footprint;
  double bottom = 0, top = 0;  ///< m, z
};

/// m: edge of the cubes in which the mesh's surface is replaced by the hull of its projection. The error is
/// less than a cube.
inline constexpr double kMeshCell = 0.25;

/// Ascending by cube (z, y, x). Uses larger cubes if more than `max_pieces` would result. The mesh must have
/// passed check_mesh().
std::vector<MeshPiece> mesh_pieces(const ModelMesh& mesh, std::size_t max_pieces = 2'000'000);

}  // namespace parhelion::simulation
