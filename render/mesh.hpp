// Unit meshes of the four shapes, by level of detail. A vertex is core * scale + direction * bevel, so that
// one mesh serves every size of its shape with a bevel of constant width (see ShapeScale).
#pragma once

#include <cstdint>
#include <vector>

#include "protocols/scene.hpp"

namespace parhelion::render {

struct MeshVertex {
  float core[3];
  float direction[3];  ///< unit; also the normal
};

struct Mesh {
  std::vector<MeshVertex> vertices;
  std::vector<std::uint16_t> indices;  ///< triangles, counter-clockwise from outside
};

/// Converts a mesh's vertices to a shape's: point = core * scale + direction * bevel.
struct ShapeScale {
  Eigen::Vector3f scale;
  float bevel;  ///< m; the radius for spheres and capsules
};

/// m, width of the chamfer on the edges of boxes and cylinders: 6 mm, less on small ones.
double edge_bevel(const Shape& shape);
ShapeScale shape_scale(const Shape& shape, bool bevelled);
/// Half extents of the shape's bounding box in its own frame, m.
Eigen::Vector3d half_extents(const Shape& shape);

/// Segments per circle, by level of detail.
inline constexpr int kSegments[] = {8, 12, 16, 24, 36, 52, 76, 112};
inline constexpr int kLevels = 8;

Mesh make_mesh(ShapeKind kind, int segments, bool bevelled);

}  // namespace parhelion::render
