// Meshes of a model in its YAML: vertices and triangles as `!!binary`.
#pragma once

#include <vector>

#include "protocols/model.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion {

/// All meshes of a model together; more is no furniture but a whole cloud.
inline constexpr std::size_t max_model_triangles = 1'000'000;

/// What is wrong with a mesh, or nothing: a vertex that is not finite or farther than 1,000 km, a triangle
/// with a vertex that is not there.
Status check_mesh(const ModelMesh& mesh);

/// `list` has passed yaml::check(); what is wrong goes to `problems`.
std::vector<ModelMesh> read_meshes(const yaml::Node& list, yaml::Problems& problems);
void write_meshes(const std::vector<ModelMesh>& meshes, yaml::Writer& writer);

}  // namespace parhelion
