#include "protocols/coarse_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

namespace parhelion {
namespace {

constexpr int kFinestCells = 128;  // along the longest side

float longest_side(const ShapeMesh& mesh) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : mesh.vertices) box.extend(p);
  return std::max(box.sizes().maxCoeff(), 1e-6F);
}

/// Vertices of one cell of side `cell` become their mean; triangles that vanish are left out (Rossignac and
/// Borrel, Multi-resolution 3D approximations for rendering complex scenes, 1993).
TriangleMesh clustered(const ShapeMesh& mesh, float cell) {
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
  TriangleMesh result;
  for (std::size_t i = 0; i < sums.size(); ++i) result.vertices.emplace_back(sums[i] / counts[i]);
  for (const MeshTriangle& triangle : mesh.triangles) {
    const MeshTriangle t{cell_of[triangle[0]], cell_of[triangle[1]], cell_of[triangle[2]]};
    if (t[0] != t[1] && t[1] != t[2] && t[0] != t[2]) result.triangles.push_back(t);
  }
  return result;
}

}  // namespace

TriangleMesh coarse_mesh(const ShapeMesh& mesh, std::size_t max_triangles) {
  if (mesh.triangles.size() <= max_triangles) return {mesh.vertices, mesh.triangles};
  const float side = longest_side(mesh);
  for (int cells = kFinestCells;; cells = cells * 3 / 4) {
    TriangleMesh coarse = clustered(mesh, side / static_cast<float>(cells));
    if (coarse.triangles.size() <= max_triangles || cells < 8) return coarse;
  }
}

}  // namespace parhelion
