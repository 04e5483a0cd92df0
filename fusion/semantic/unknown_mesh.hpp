// The surface of what has no label: furniture and all else, as triangles that collide and hide.
//
// Cubes that hold points are solid; the faces between solid and empty cubes are the surface, and each corner
// is drawn to the mean of the points in the cubes around it (vertex clustering, Rossignac and Borrel 1993).
// So the surface lies where points are, within a cube.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/model.hpp"
#include "protocols/status.hpp"

namespace parhelion::semantic {

struct UnknownMeshOptions {
  double cube = 0.10;                   ///< m, > 0; made larger where there would be too many triangles
  std::size_t most_triangles = 50'000;  ///< of the whole mesh...
  double triangles_per_m2 = 600;  ///< ...or so many for the plan that it covers: large sites stay as fine
  std::uint32_t min_points = 3;   ///< in a cube, else it is noise...
  std::size_t min_cubes = 4;      ///< ...and so are fewer connected cubes than this
};

struct UnknownMesh {
  ModelMesh mesh;              ///< named "unknown"; empty where there is nothing
  double cube = 0;             ///< m: no point of the surface is farther from a point than a cube's diagonal
  std::uint64_t left_out = 0;  ///< points taken for noise
};

/// Of the points with label `unknown`. `labels`: one per point. Errors: labels that do not fit, options out
/// of range.
Result<UnknownMesh> unknown_mesh(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels,
                                 const UnknownMeshOptions& options = {});

}  // namespace parhelion::semantic
