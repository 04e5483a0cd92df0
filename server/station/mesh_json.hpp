// Meshes of robots and objects for the page: each is fetched once, by its id, and drawn wherever a shape
// names it.
#pragma once

#include <map>
#include <string>

#include "protocols/shape_mesh.hpp"
#include "server/station/http/cached_content.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::station {

/// 16 hexadecimal digits, a function of the mesh's vertices and triangles (FNV-1a).
std::string mesh_id(const ShapeMesh& mesh);

/// {vertices: [x, y, z, ...] (m, shape frame), triangles: [a, b, c, ...]}. A mesh of more than 20,000
/// triangles is coarsened: vertices of one cell of a grid become their mean.
std::string mesh_json(const ShapeMesh& mesh);

/// GET /api/v1/mesh?ID, for all meshes of the session's robot models and of the site's movable objects.
using MeshContents = std::map<std::string, CachedContent, std::less<>>;
MeshContents mesh_contents(const tick::RobotModels& models, const std::vector<ModelObject>& objects = {});

}  // namespace parhelion::station
