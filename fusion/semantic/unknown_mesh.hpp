// The surface of unlabelled points (furniture and other objects) as triangles for collision and occlusion.
//
// Cubes that hold points are solid; the faces between solid and empty cubes form the surface, and each corner
// is moved to the mean of the points in the cubes around it (vertex clustering, Rossignac and Borrel 1993).
// The surface is therefore within a cube of the points.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/model.hpp"
#include "protocols/status.hpp"

namespace parhelion::semantic {

struct UnknownMeshOptions {
  double cube = 0.10;                  ///< m, > 0; enlarged where there would be too many triangles
  std::size_t max_triangles = 50'000;  ///< maximum for the whole mesh...
  double triangles_per_m2 = 600;  ///< ...or this number per m^2 of the plan that it covers, so that large
                                  ///< sites keep their resolution
  std::uint32_t min_points = 3;   ///< minimum in a cube; fewer are noise
  std::size_t min_cubes = 4;      ///< minimum connected cubes; fewer are noise
};

struct UnknownMesh {
  ModelMesh mesh;                   ///< named "unknown"; empty where there is nothing
  double cube = 0;                  ///< m: the surface is within a cube's diagonal of the points
  std::uint64_t left_out = 0;       ///< points classified as noise
  std::vector<ModelMesh> of_owner;  ///< without names; a cube is of the owner of most of its points
};

/// Meshes the points with label `unknown`. `labels`: one per point. `owner_of`: per point the number of its
/// owner, or one that is not less than `owners`; owners' parts are meshes of their own, without faces between
/// parts that touch. Errors: labels that do not fit, options out of range.
Result<UnknownMesh> unknown_mesh(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels,
                                 const UnknownMeshOptions& options = {},
                                 std::span<const std::uint32_t> owner_of = {}, std::size_t owners = 0);

}  // namespace parhelion::semantic
