// The triangles of a shape that is a mesh, such as a part of a robot, with a tree for rays.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion {

/// A node of a bounding volume hierarchy: a leaf has triangles, an inner node two children.
struct MeshNode {
  Eigen::Vector3f min = Eigen::Vector3f::Zero(), max = Eigen::Vector3f::Zero();  ///< m, shape frame
  std::uint32_t first = 0;  ///< leaf: first triangle; inner: left child, the right one follows it
  std::uint32_t count = 0;  ///< of triangles; 0: an inner node
};

using MeshTriangle = std::array<std::uint32_t, 3>;  ///< indices of vertices, counter-clockwise from outside

/// Immutable; shared by all shapes that show it. Its frame's origin is the middle of its bounding box.
struct ShapeMesh {
  std::vector<Eigen::Vector3f> vertices;  ///< m, shape frame
  std::vector<MeshTriangle> triangles;    ///< in the order of the leaves
  std::vector<MeshNode> tree;             ///< root first
};

/// m, farthest coordinate of a mesh's vertex.
inline constexpr float kMeshExtent = 1000;

struct CenteredMesh {
  std::shared_ptr<const ShapeMesh> mesh;
  Eigen::Vector3d center;  ///< m, of the bounding box, in the frame of the vertices given
  Eigen::Vector3d size;    ///< m, of the bounding box; at least 1 mm
};

/// Moves the vertices to the middle of their bounding box, and builds the tree (split at the median of the
/// longest axis). Error: no triangle, a vertex that is not finite or farther than kMeshExtent, an invalid
/// index.
Result<CenteredMesh> make_shape_mesh(std::vector<Eigen::Vector3f> vertices,
                                     std::vector<MeshTriangle> triangles);

/// Vertices of the mesh that are the farthest in evenly distributed directions: corners of its convex hull,
/// at most 102, without duplicates. Every corner of a box is among them.
std::vector<Eigen::Vector3d> hull_corners(const std::vector<Eigen::Vector3f>& vertices);

}  // namespace parhelion
