#include "protocols/shape_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>

namespace parhelion {
namespace {

constexpr std::uint32_t kLeaf = 4;       // triangles
constexpr double kMinSize = 1e-3;        // m
constexpr std::size_t kDirections = 96;  // besides the six axes

class TreeBuilder {
 public:
  explicit TreeBuilder(ShapeMesh& mesh) : mesh_(mesh) {
    mesh_.tree.resize(1);
    split(0, 0, static_cast<std::uint32_t>(mesh_.triangles.size()));
  }

 private:
  Eigen::Vector3f middle(const MeshTriangle& triangle) const {
    return (mesh_.vertices[triangle[0]] + mesh_.vertices[triangle[1]] + mesh_.vertices[triangle[2]]) / 3;
  }

  void bound(MeshNode& node, std::uint32_t first, std::uint32_t count) const {
    node.min.setConstant(kMeshExtent * 2);
    node.max = -node.min;
    for (std::uint32_t i = first; i < first + count; ++i) {
      for (const std::uint32_t v : mesh_.triangles[i]) {
        node.min = node.min.cwiseMin(mesh_.vertices[v]);
        node.max = node.max.cwiseMax(mesh_.vertices[v]);
      }
    }
  }

  void split(std::size_t index, std::uint32_t first, std::uint32_t count) {
    bound(mesh_.tree[index], first, count);
    mesh_.tree[index].first = first;
    mesh_.tree[index].count = count;
    if (count <= kLeaf) return;
    Eigen::Index axis = 0;
    (mesh_.tree[index].max - mesh_.tree[index].min).maxCoeff(&axis);
    const auto begin = mesh_.triangles.begin() + first;
    const std::uint32_t half = count / 2;
    // The whole triangle decides between equal middles: the tree does not depend on the library's algorithm.
    std::nth_element(begin, begin + half, begin + count, [&](const MeshTriangle& a, const MeshTriangle& b) {
      const float at_a = middle(a)[axis], at_b = middle(b)[axis];
      return at_a < at_b || (at_a == at_b && a < b);
    });
    const auto left = static_cast<std::uint32_t>(mesh_.tree.size());
    mesh_.tree.resize(mesh_.tree.size() + 2);
    mesh_.tree[index].first = left;
    mesh_.tree[index].count = 0;
    split(left, first, half);
    split(left + 1, first + half, count - half);
  }

  ShapeMesh& mesh_;
};

Status check(const std::vector<Eigen::Vector3f>& vertices, const std::vector<MeshTriangle>& triangles) {
  if (triangles.empty()) return Error{"it has no triangle"};
  for (const Eigen::Vector3f& vertex : vertices) {
    if (!vertex.allFinite() || vertex.cwiseAbs().maxCoeff() > kMeshExtent)
      return Error{"a vertex is not finite or farther than " + std::to_string(static_cast<int>(kMeshExtent)) +
                   " m from its origin"};
  }
  for (const MeshTriangle& triangle : triangles) {
    for (const std::uint32_t index : triangle) {
      if (index >= vertices.size())
        return Error{"a triangle has vertex " + std::to_string(index) + " of " +
                     std::to_string(vertices.size())};
    }
  }
  return {};
}

/// Evenly distributed on the sphere: a Fibonacci lattice (Swinbank and Purser 2006), and the axes.
std::vector<Eigen::Vector3f> directions() {
  std::vector<Eigen::Vector3f> all;
  for (std::size_t i = 0; i < kDirections; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / kDirections;
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / std::numbers::phi;
    const double r = std::sqrt(1 - z * z);
    all.push_back(Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z).cast<float>());
  }
  for (const int axis : {0, 1, 2}) {
    all.push_back(Eigen::Vector3f::Unit(axis));
    all.push_back(-Eigen::Vector3f::Unit(axis));
  }
  return all;
}

}  // namespace

Result<CenteredMesh> make_shape_mesh(std::vector<Eigen::Vector3f> vertices,
                                     std::vector<MeshTriangle> triangles) {
  if (Status status = check(vertices, triangles); !status) return status.error();
  Eigen::Vector3f min = vertices[triangles[0][0]], max = min;
  for (const MeshTriangle& triangle : triangles) {
    for (const std::uint32_t index : triangle) {
      min = min.cwiseMin(vertices[index]);
      max = max.cwiseMax(vertices[index]);
    }
  }
  const Eigen::Vector3f center = (min + max) / 2;
  for (Eigen::Vector3f& vertex : vertices) vertex -= center;
  auto mesh = std::make_shared<ShapeMesh>();
  mesh->vertices = std::move(vertices);
  mesh->triangles = std::move(triangles);
  TreeBuilder build(*mesh);
  return CenteredMesh{std::move(mesh), center.cast<double>(), (max - min).cast<double>().cwiseMax(kMinSize)};
}

std::vector<Eigen::Vector3d> hull_corners(const std::vector<Eigen::Vector3f>& vertices) {
  std::set<std::size_t> corners;
  for (const Eigen::Vector3f& direction : directions()) {
    const auto farthest =
        std::max_element(vertices.begin(), vertices.end(),
                         [&](const auto& a, const auto& b) { return a.dot(direction) < b.dot(direction); });
    if (farthest != vertices.end()) corners.insert(static_cast<std::size_t>(farthest - vertices.begin()));
  }
  std::vector<Eigen::Vector3d> points;
  for (const std::size_t index : corners) {
    const Eigen::Vector3d point = vertices[index].cast<double>();
    if (std::find(points.begin(), points.end(), point) == points.end()) points.push_back(point);
  }
  return points;
}

}  // namespace parhelion
