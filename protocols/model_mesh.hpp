// Meshes of a model in its YAML: vertices and triangles as `!!binary`.
#pragma once

#include <vector>

#include "protocols/model.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion {

/// For all meshes of a model together; a larger number indicates a whole cloud instead of furniture.
inline constexpr std::size_t kMaxModelTriangles = 1'000'000;

/// Why a mesh is invalid, or success: a vertex that is not finite or farther than 1,000 km, a triangle with
/// an invalid vertex index.
Status check_mesh(const ModelMesh& mesh);

/// `list` has passed yaml::check(); errors go to `problems`.
std::vector<ModelMesh> read_meshes(const yaml::Node& list, yaml::Problems& problems);
/// Vertices and triangles of one mesh, without a name.
ModelMesh read_triangles(const yaml::Node& node, yaml::Problems& problems);
void write_triangles(const ModelMesh& mesh, yaml::Writer& writer);
void write_meshes(const std::vector<ModelMesh>& meshes, yaml::Writer& writer);

}  // namespace parhelion
