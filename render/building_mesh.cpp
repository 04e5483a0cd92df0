#include "render/building_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace parhelion::render {
namespace {

constexpr double kChunk = 2.0;  ///< m, side of the cubes that group triangles

using Corners = std::array<Eigen::Vector3f, 3>;
using Cube = std::array<int, 3>;

Cube cube_of(const Corners& p) {
  const Eigen::Vector3f middle = (p[0] + p[1] + p[2]) / 3;
  const auto index = [](float x) { return static_cast<int>(std::floor(static_cast<double>(x) / kChunk)); };
  return {index(middle.x()), index(middle.y()), index(middle.z())};
}

void append(const Corners& p, std::array<std::size_t, 3> order, std::vector<MeshVertex>& vertices) {
  const Eigen::Vector3f normal = (p[order[1]] - p[order[0]]).cross(p[order[2]] - p[order[0]]).normalized();
  for (const std::size_t i : order)
    vertices.push_back({{p[i].x(), p[i].y(), p[i].z()}, {normal.x(), normal.y(), normal.z()}});
}

}  // namespace

BuildingMesh building_mesh(const SemanticModel& model) {
  std::map<Cube, std::vector<Corners>> sorted;
  for (const ModelMesh& mesh : model.meshes) {
    for (const auto& [a, b, c] : mesh.triangles) {
      if (std::max({a, b, c}) >= mesh.vertices.size()) continue;
      const Corners corners{mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]};
      const float area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
      if (area > 0 && std::isfinite(area)) sorted[cube_of(corners)].push_back(corners);
    }
  }
  BuildingMesh result;
  for (const auto& [cube, triangles] : sorted) {
    MeshChunk chunk;
    chunk.first = static_cast<std::uint32_t>(result.vertices.size());
    for (const Corners& corners : triangles) {
      for (const Eigen::Vector3f& p : corners) chunk.box.extend(p.cast<double>());
      append(corners, {0, 1, 2}, result.vertices);
      append(corners, {0, 2, 1}, result.vertices);
    }
    chunk.count = static_cast<std::uint32_t>(result.vertices.size()) - chunk.first;
    result.chunks.push_back(chunk);
  }
  return result;
}

}  // namespace parhelion::render
