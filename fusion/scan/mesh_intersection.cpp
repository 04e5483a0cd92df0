#include "fusion/scan/mesh_intersection.hpp"

#include <array>
#include <limits>

#include "fusion/scan/shape_intersection.hpp"

namespace parhelion::scan {
namespace {

/// More than twice the depth of a tree that halves 2^32 triangles at each level.
constexpr std::size_t kStack = 72;

/// m, where the line enters the node's box; +inf: it misses it, or the box lies behind.
double enters(const MeshNode& node, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  constexpr double hair = 1e-6;  // a flat box has a thickness
  const Eigen::Vector3d min = node.min.cast<double>(), max = node.max.cast<double>();
  const Eigen::Vector3d half = (max - min) / 2 + Eigen::Vector3d::Constant(hair);
  return box_chord(origin - (min + max) / 2, direction, half).range();
}

}  // namespace

double mesh_range(const ShapeMesh& mesh, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  double nearest = std::numeric_limits<double>::infinity();
  std::array<std::uint32_t, kStack> stack{};
  std::size_t depth = 1;
  const auto corner = [&](std::uint32_t i) { return Eigen::Vector3d(mesh.vertices[i].cast<double>()); };
  while (depth > 0) {
    const MeshNode& node = mesh.tree[stack[--depth]];
    if (!(enters(node, origin, direction) < nearest)) continue;
    if (node.count == 0) {
      stack[depth++] = node.first;
      stack[depth++] = node.first + 1;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const MeshTriangle& t = mesh.triangles[i];
      nearest =
          std::min(nearest, triangle_range(origin, direction, corner(t[0]), corner(t[1]), corner(t[2])));
    }
  }
  return nearest;
}

}  // namespace parhelion::scan
