#include "render/shape_mesh_vertices.hpp"

#include <cmath>

namespace parhelion::render {
namespace {

constexpr float kCrease = 0.766F;  // cosine of 40 degrees

/// Of a triangle; its length is twice the area, which weights it in a mean.
Eigen::Vector3f face_normal(const ShapeMesh& mesh, const MeshTriangle& t) {
  const Eigen::Vector3f& a = mesh.vertices[t[0]];
  return (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
}

}  // namespace

std::vector<MeshVertex> shape_mesh_vertices(const ShapeMesh& mesh) {
  std::vector<std::vector<Eigen::Vector3f>> normals_at(mesh.vertices.size());
  for (const MeshTriangle& t : mesh.triangles) {
    for (const std::uint32_t corner : t) normals_at[corner].push_back(face_normal(mesh, t));
  }
  std::vector<MeshVertex> vertices;
  vertices.reserve(mesh.triangles.size() * 3);
  for (const MeshTriangle& t : mesh.triangles) {
    const Eigen::Vector3f own = face_normal(mesh, t).normalized();
    for (const std::uint32_t corner : t) {
      Eigen::Vector3f normal = Eigen::Vector3f::Zero();
      for (const Eigen::Vector3f& other : normals_at[corner]) {
        if (other.dot(own) >= kCrease * other.norm()) normal += other;
      }
      if (!(normal.norm() > 0)) normal = own;  // of a triangle without area: zero, and nothing is drawn
      normal.normalize();
      const Eigen::Vector3f& at = mesh.vertices[corner];
      vertices.push_back({{at.x(), at.y(), at.z()}, {normal.x(), normal.y(), normal.z()}});
    }
  }
  return vertices;
}

}  // namespace parhelion::render
