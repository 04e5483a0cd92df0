#include "server/station/mesh_json.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

namespace parhelion::station {
namespace {

constexpr std::size_t kMaxTriangles = 20'000;
constexpr int kFinestCells = 128;  // along the longest side

struct Triangles {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<MeshTriangle> triangles;
};

float longest_side(const ShapeMesh& mesh) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : mesh.vertices) box.extend(p);
  return std::max(box.sizes().maxCoeff(), 1e-6F);
}

/// Vertices of one cell of side `cell` become their mean; triangles that vanish are left out (Rossignac and
/// Borrel, Multi-resolution 3D approximations for rendering complex scenes, 1993).
Triangles clustered(const ShapeMesh& mesh, float cell) {
  std::map<std::array<int, 3>, std::uint32_t> cells;
  std::vector<std::uint32_t> cell_of;
  std::vector<Eigen::Vector3f> sums;
  std::vector<float> counts;
  for (const Eigen::Vector3f& p : mesh.vertices) {
    const Eigen::Array3i at = (p.array() / cell).floor().cast<int>();
    const auto [found, is_new] =
        cells.try_emplace({at.x(), at.y(), at.z()}, static_cast<std::uint32_t>(sums.size()));
    if (is_new) sums.push_back(Eigen::Vector3f::Zero()), counts.push_back(0);
    sums[found->second] += p;
    ++counts[found->second];
    cell_of.push_back(found->second);
  }
  Triangles result;
  for (std::size_t i = 0; i < sums.size(); ++i) result.vertices.emplace_back(sums[i] / counts[i]);
  for (const MeshTriangle& triangle : mesh.triangles) {
    const MeshTriangle t{cell_of[triangle[0]], cell_of[triangle[1]], cell_of[triangle[2]]};
    if (t[0] != t[1] && t[1] != t[2] && t[0] != t[2]) result.triangles.push_back(t);
  }
  return result;
}

Triangles shown(const ShapeMesh& mesh) {
  if (mesh.triangles.size() <= kMaxTriangles) return {mesh.vertices, mesh.triangles};
  const float side = longest_side(mesh);
  for (int cells = kFinestCells;; cells = cells * 3 / 4) {
    Triangles coarse = clustered(mesh, side / static_cast<float>(cells));
    if (coarse.triangles.size() <= kMaxTriangles || cells < 8) return coarse;
  }
}

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
  const Triangles all = shown(mesh);
  nlohmann::json vertices = nlohmann::json::array(), triangles = nlohmann::json::array();
  for (const Eigen::Vector3f& p : all.vertices) {
    for (const float coordinate : p) vertices.push_back(rounded(coordinate));
  }
  for (const MeshTriangle& triangle : all.triangles)
    for (const std::uint32_t corner : triangle) triangles.push_back(corner);
  return nlohmann::json{{"vertices", std::move(vertices)}, {"triangles", std::move(triangles)}}.dump();
}

MeshContents mesh_contents(const tick::RobotModels& models) {
  MeshContents contents;
  for (const auto& model : models) {
    for (const simulation::RobotLink& link : model->links) {
      for (const Shape& shape : link.visible) {
        if (!shape.mesh) continue;
        const std::string id = mesh_id(*shape.mesh);
        if (!contents.contains(id))
          contents.emplace(id, cached_content("application/json", mesh_json(*shape.mesh)));
      }
    }
  }
  return contents;
}

}  // namespace parhelion::station
