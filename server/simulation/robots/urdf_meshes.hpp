// Meshes in a URDF. The text that a session embeds must not depend on files: their contents replace their
// names.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "protocols/scene.hpp"
#include "protocols/status.hpp"

namespace parhelion::simulation {

struct EmbeddedUrdf {
  std::string urdf;                   ///< lines as before
  std::vector<std::string> warnings;  ///< one for each file that was not read: URDF, line, paths tried
};

/// Replaces each mesh's file name by its triangles (a `data:` URI, RFC 2397). `path`: of the URDF. A name is
/// relative to its folder, absolute, file://, or package://NAME/..., which is looked for in NAME in the
/// URDF's folder and the folders above it, then in those of the environment's ROS_PACKAGE_PATH. A file that
/// is missing or damaged keeps its name.
EmbeddedUrdf embed_meshes(const std::string& urdf, const std::string& path);

/// Whether a mesh's file name holds its triangles.
bool is_embedded(const std::string& filename);

/// An embedded mesh as shapes of kind mesh, one for each of its colours, whose material has that colour if
/// `colored`. T_link_mesh: of the URDF's <origin>; `scale`: of its <mesh>, not zero. Error: damaged
/// triangles.
Result<std::vector<Shape>> mesh_shapes(const std::string& filename, const Eigen::Isometry3d& T_link_mesh,
                                       const Eigen::Vector3d& scale, const Material& material, bool colored);
/// All colours as one shape: for collision, which is that of the convex hull.
Result<Shape> solid_mesh_shape(const std::string& filename, const Eigen::Isometry3d& T_link_mesh,
                               const Eigen::Vector3d& scale);

}  // namespace parhelion::simulation
