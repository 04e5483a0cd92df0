// Meshes of a robot's parts from files: STL, COLLADA (.dae), OBJ, glTF (.glb, .gltf) and what else Assimp
// reads.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "protocols/mesh_bytes.hpp"
#include "protocols/status.hpp"

namespace parhelion {

/// At most this many triangles of a file are kept; a finer mesh is simplified by merging the vertices in each
/// cell of a grid (Rossignac and Borrel 1993).
inline constexpr std::size_t kMaxMeshTriangles = 5000;

/// One part for each colour. Coordinates are those of the file, in m (COLLADA states its unit); as in RViz,
/// the file's statement of its upward axis is ignored. Textures are not read. Works in a child process with
/// limited memory and time, as a damaged file can crash the library. Errors name the path: no such file, not
/// readable, no triangles.
Result<std::vector<MeshPart>> read_mesh_file(const std::string& path);

}  // namespace parhelion
