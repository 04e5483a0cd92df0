#include "server/station/mesh_json.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "protocols/coarse_mesh.hpp"
#include "server/simulation/bodies/movable_objects.hpp"

namespace parhelion::station {
namespace {

constexpr std::size_t kMaxTriangles = 20'000;
void hash(std::span<const std::uint8_t> bytes, std::uint64_t& sum) {
  for (const std::uint8_t byte : bytes) sum = (sum ^ byte) * 0x100000001b3;
}

template <class T>
std::span<const std::uint8_t> bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const std::uint8_t*>(values.data()), values.size() * sizeof(T)};
}

/// To 0.1 mm.
double rounded(float value) { return std::round(static_cast<double>(value) * 1e4) / 1e4; }

}  // namespace

std::string mesh_id(const ShapeMesh& mesh) {
  std::uint64_t sum = 0xcbf29ce484222325;
  hash(bytes_of(mesh.vertices), sum);
  hash(bytes_of(mesh.triangles), sum);
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(sum));
  return text.data();
}

std::string mesh_json(const ShapeMesh& mesh) {
  const TriangleMesh all = coarse_mesh(mesh, kMaxTriangles);
  nlohmann::json vertices = nlohmann::json::array(), triangles = nlohmann::json::array();
  for (const Eigen::Vector3f& p : all.vertices) {
    for (const float coordinate : p) vertices.push_back(rounded(coordinate));
  }
  for (const MeshTriangle& triangle : all.triangles)
    for (const std::uint32_t corner : triangle) triangles.push_back(corner);
  return nlohmann::json{{"vertices", std::move(vertices)}, {"triangles", std::move(triangles)}}.dump();
}

MeshContents mesh_contents(const tick::RobotModels& models, const std::vector<ModelObject>& objects) {
  MeshContents contents;
  const auto add = [&contents](const std::vector<Shape>& shapes) {
    for (const Shape& shape : shapes) {
      if (!shape.mesh) continue;
      const std::string id = mesh_id(*shape.mesh);
      if (!contents.contains(id))
        contents.emplace(id, cached_content("application/json", mesh_json(*shape.mesh)));
    }
  };
  for (const auto& model : models) {
    for (const simulation::RobotLink& link : model->links) add(link.visible);
  }
  for (const ModelObject& object : objects) add(simulation::object_body(object, 1).shapes);
  return contents;
}

}  // namespace parhelion::station
