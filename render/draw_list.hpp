// The contents of one frame: visible shapes, their shadows and their occluders, culled and with the level of
// detail by projected size. In the optical frame of the camera, single precision: coordinates there are
// small.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "protocols/model.hpp"
#include "protocols/scan.hpp"
#include "protocols/world.hpp"
#include "render/building_mesh.hpp"
#include "render/camera_model.hpp"
#include "render/mesh.hpp"

namespace parhelion::render {

/// One shape, in the layout of the vertex shader.
struct Instance {
  float rotation[9];  ///< R_optical_shape, column by column
  float translation[3];
  float scale[3];
  float bevel;
  float albedo[3];
  float roughness;
  float metallic;
  float entity;  ///< 1 + index into DrawList::entities; 0: none
};

/// One vertex of a shadow on the floor.
struct ShadowVertex {
  float position[3];  ///< optical frame, m
  float local[2];     ///< m, in the footprint's own axes
  float half[2];      ///< m, half extents of the footprint
  float corner;       ///< m, radius of its corners
  float softness;     ///< m, of the wide penumbra
  float contact;      ///< 0..1, darkness of the narrow one
  float ambient;      ///< 0..1, darkness of the wide one
};

/// A shape that is a mesh.
struct PlacedMesh {
  std::shared_ptr<const ShapeMesh> mesh;
  Instance instance;
};

inline constexpr std::size_t kMeshes = 4 * kLevels * 2;
constexpr std::size_t mesh_index(ShapeKind kind, int level, bool bevelled) {
  return (static_cast<std::size_t>(kind) * kLevels + static_cast<std::size_t>(level)) * 2 +
         (bevelled ? 1 : 0);
}

struct DrawList {
  std::array<std::vector<Instance>, kMeshes> shapes;  ///< by mesh_index
  std::vector<ShadowVertex> shadows;                  ///< triangles
  std::vector<PlacedMesh> shape_meshes;               ///< shapes that are meshes
  std::vector<Instance> occluders;                    ///< plain boxes
  std::vector<PlacedMesh> occluder_meshes;            ///< occluders that are meshes
  std::vector<std::uint32_t> mesh_chunks;  ///< chunks of the building's mesh that may occlude something
  std::vector<std::uint32_t> mesh_shown;   ///< chunks that are drawn like a shape
  Instance mesh{};                         ///< pose and material of the building's mesh
  std::vector<std::string> entities;       ///< names, by Instance::entity - 1
  std::vector<PixelRect> view_rects;       ///< touched rectangle of each view
  double farthest = 0;                     ///< m along the ray, upper bound of the distance of drawn points

  bool empty() const;
  void clear(std::size_t views);
};

/// m, near clipping plane.
inline constexpr double kNearPlane = 0.02;
/// m, an occluder must be nearer than a drawn surface by more than this to hide it, so that bodies against a
/// wall or on the floor stay visible.
inline constexpr double kOcclusionBias = 0.03;

/// The pixels of a view that a convex hull of points (optical frame) may touch; empty where all are behind
/// the near plane. `edges`: pairs of indices that bound it.
PixelRect projected_box(const PinholeView& view, const Transform<CameraOptical, ShapeFrame>& T_optical_shape,
                        const Eigen::Vector3d& half);

/// Adds each body for which `drawn` holds and that may be visible; optionally with its shadow on the plane z
/// = floor_z (map).
void add_bodies(DrawList& list, const CameraProjection& projection,
                const Transform<Map, CameraOptical>& T_map_optical, const WorldSnapshot& world,
                const std::function<bool(const BodyDefinition&)>& drawn, const double* floor_z);

/// Where shadows are seen from, and the floor that they are on.
struct ShadowView {
  const CameraProjection& projection;
  const Transform<Map, CameraOptical>& T_map_optical;
  double floor_z = 0;   ///< m, map
  double strength = 1;  ///< scales their darkness
};

/// Adds the shadow of one shape, or nothing where it casts none.
void add_shadow(const ShadowView& view, const Shape& shape, const Transform<Map, ShapeFrame>& T_map_shape,
                std::vector<ShadowVertex>& shadows, std::vector<PixelRect>& view_rects);

/// Adds a box (half extents, m) as an occluder, where it may be in front of something drawn.
void add_occluder(DrawList& list, const CameraProjection& projection,
                  const Transform<CameraOptical, ShapeFrame>& T_optical_box, const Eigen::Vector3d& half);

/// The same for a shape that is a mesh.
void add_occluder(DrawList& list, const CameraProjection& projection,
                  const Transform<CameraOptical, ShapeFrame>& T_optical_shape, const Shape& shape);

/// Adds the chunks of the building's mesh that may be in front of something drawn.
void add_mesh_occluders(DrawList& list, const CameraProjection& projection,
                        const Transform<Map, CameraOptical>& T_map_optical, const BuildingMesh& mesh);

/// The chunks that may be visible in a rectangle of some view (`rects`: one per view), ascending.
std::vector<std::uint32_t> seen_chunks(const CameraProjection& projection,
                                       const Transform<Map, CameraOptical>& T_map_optical,
                                       const BuildingMesh& mesh, const std::vector<PixelRect>& rects,
                                       double farthest);
/// The mesh, which is in the map frame, as an instance of a single colour.
Instance mesh_instance(const Transform<Map, CameraOptical>& T_map_optical, const Material& material);

Instance make_instance(const Transform<CameraOptical, ShapeFrame>& T_optical_shape, const ShapeScale& scale,
                       const Material& material, std::size_t entity);

}  // namespace parhelion::render
