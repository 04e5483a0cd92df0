#include "server/simulation/building/mesh_pieces.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>

namespace parhelion::simulation {
namespace {

using Polygon = std::vector<Eigen::Vector3d>;
using Cube = std::array<std::int64_t, 3>;  // z, y, x: a map is then ordered by height first

/// Sutherland-Hodgman: the part of `polygon` with low <= p[axis] <= high.
void clip(const Polygon& polygon, int axis, double low, double high, Polygon& scratch, Polygon& out) {
  const auto half = [axis](const Polygon& in, double bound, double sign, Polygon& kept) {
    kept.clear();
    for (std::size_t i = 0; i < in.size(); ++i) {
      const Eigen::Vector3d &a = in[i], &b = in[(i + 1) % in.size()];
      const double side_a = sign * (a[axis] - bound), side_b = sign * (b[axis] - bound);
      if (side_a <= 0) kept.push_back(a);
      if ((side_a < 0 && side_b > 0) || (side_a > 0 && side_b < 0))
        kept.push_back(a + (b - a) * (side_a / (side_a - side_b)));
    }
  };
  half(polygon, high, 1, scratch);
  half(scratch, low, -1, out);
}

struct Extent {
  Eigen::Vector3d low, high;
};

Extent extent_of(const ModelMesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  const Eigen::Vector3d a = mesh.vertices[triangle[0]].cast<double>(),
                        b = mesh.vertices[triangle[1]].cast<double>(),
                        c = mesh.vertices[triangle[2]].cast<double>();
  return {a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)};
}

double cubes_met(const ModelMesh& mesh, double cell) {
  double sum = 0;
  for (const auto& triangle : mesh.triangles) {
    const Extent extent = extent_of(mesh, triangle);
    sum += (((extent.high - extent.low) / cell).array() + 1).prod();
  }
  return sum;
}

void cut(const ModelMesh& mesh, const std::array<std::uint32_t, 3>& triangle, double cell,
         std::map<Cube, Polygon>& points) {
  const Extent extent = extent_of(mesh, triangle);
  const auto index = [cell](double x) { return static_cast<std::int64_t>(std::floor(x / cell)); };
  const auto bounds = [cell](std::int64_t at) {
    return std::pair{static_cast<double>(at) * cell, static_cast<double>(at + 1) * cell};
  };
  Polygon whole, slab, row, piece, scratch;
  for (const std::uint32_t i : triangle) whole.push_back(mesh.vertices[i].cast<double>());
  for (std::int64_t z = index(extent.low.z()); z <= index(extent.high.z()); ++z) {
    clip(whole, 2, bounds(z).first, bounds(z).second, scratch, slab);
    if (slab.empty()) continue;
    for (std::int64_t y = index(extent.low.y()); y <= index(extent.high.y()); ++y) {
      clip(slab, 1, bounds(y).first, bounds(y).second, scratch, row);
      if (row.empty()) continue;
      for (std::int64_t x = index(extent.low.x()); x <= index(extent.high.x()); ++x) {
        clip(row, 0, bounds(x).first, bounds(x).second, scratch, piece);
        if (piece.empty()) continue;
        Polygon& cube = points[{z, y, x}];
        cube.insert(cube.end(), piece.begin(), piece.end());
      }
    }
  }
}

}  // namespace

std::vector<MeshPiece> mesh_pieces(const ModelMesh& mesh, std::size_t max_pieces) {
  double cell = kMeshCell;
  const double limit = static_cast<double>(std::max(max_pieces, 2 * mesh.triangles.size()));
  while (cubes_met(mesh, cell) > limit) cell *= 2;
  std::map<Cube, Polygon> points;
  for (const auto& triangle : mesh.triangles) cut(mesh, triangle, cell, points);
  std::vector<MeshPiece> pieces;
  pieces.reserve(points.size());
  for (const auto& [cube, polygon] : points) {
    MeshPiece piece;
    std::vector<Eigen::Vector2d> plan;
    piece.bottom = piece.top = polygon.front().z();
    for (const Eigen::Vector3d& p : polygon) {
      // Rounded to a micrometre: vertices that differ only by rounding would disturb the hull.
      plan.emplace_back(std::round(p.x() * 1e6) / 1e6, std::round(p.y() * 1e6) / 1e6);
      piece.bottom = std::min(piece.bottom, p.z());
      piece.top = std::max(piece.top, p.z());
    }
    piece.footprint = make_polygon(convex_hull(std::move(plan)));
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

}  // namespace parhelion::simulation
