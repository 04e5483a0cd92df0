#include "render/draw_list.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace parhelion::render {
namespace {

/// px, maximum distance of the polygon from its circle.
constexpr double kSagitta = 0.15;
/// px, chamfers narrower than this are not drawn.
constexpr double kVisibleBevel = 0.6;
/// m, objects higher over the floor cast no visible shadow.
constexpr double kShadowHeight = 1.0;
/// Maximum number of entities in the 10 bits of the identity buffer; later ones share the last.
constexpr std::size_t kMaxEntities = 1023;

struct Bounds {
  double u0 = 1e9, v0 = 1e9, u1 = -1e9, v1 = -1e9;
  void add(const PinholeView& view, const Eigen::Vector3d& p) {
    const double u = view.fx * p.x() / p.z() + view.cx, v = view.fy * p.y() / p.z() + view.cy;
    u0 = std::min(u0, u), v0 = std::min(v0, v), u1 = std::max(u1, u), v1 = std::max(v1, v);
  }
  PixelRect rect(const PinholeView& view) const {
    if (u0 > u1) return {};
    const auto clamp = [](double x, int limit) {
      return static_cast<int>(std::floor(std::clamp(x, -1.0, static_cast<double>(limit))));
    };
    // Two pixels of margin: anti-aliasing and the warp's bilinear filter.
    return PixelRect{clamp(u0 - 2, view.width), clamp(v0 - 2, view.height), clamp(u1 + 3, view.width) + 1,
                     clamp(v1 + 3, view.height) + 1}
        .intersected({0, 0, view.width, view.height});
  }
};

template <std::size_t N>
PixelRect projected_hull(const PinholeView& view, const std::array<Eigen::Vector3d, N>& optical,
                         const std::vector<std::pair<int, int>>& edges) {
  std::array<Eigen::Vector3d, N> p;
  for (std::size_t i = 0; i < N; ++i) p[i] = view.R_optical_view.transpose() * optical[i];
  Bounds bounds;
  for (const auto& point : p)
    if (point.z() > kNearPlane) bounds.add(view, point);
  for (const auto& [i, j] : edges) {
    const Eigen::Vector3d &a = p[static_cast<std::size_t>(i)], &b = p[static_cast<std::size_t>(j)];
    if ((a.z() > kNearPlane) == (b.z() > kNearPlane)) continue;
    bounds.add(view, a + (kNearPlane - a.z()) / (b.z() - a.z()) * (b - a));
  }
  return bounds.rect(view);
}

const std::vector<std::pair<int, int>>& box_edges() {
  static const std::vector<std::pair<int, int>> edges = [] {
    std::vector<std::pair<int, int>> e;
    for (int i = 0; i < 8; ++i)
      for (const int bit : {1, 2, 4})
        if (!(i & bit)) e.emplace_back(i, i | bit);
    return e;
  }();
  return edges;
}

int level_for(double radius_px) {
  if (radius_px <= kSagitta) return 0;
  const double wanted = std::numbers::pi / std::acos(1 - kSagitta / radius_px);
  int level = 0;
  while (level + 1 < kLevels && kSegments[level] < wanted) ++level;
  return level;
}

/// Footprint of a shape that touches or nears the floor: an upright rounded rectangle and its height.
struct Footprint {
  Eigen::Vector2d centre, half;
  double yaw, corner, bottom, top;
};

Footprint footprint(const Shape& shape, const Transform<Map, ShapeFrame>& T_map_shape) {
  const Eigen::Matrix3d R = T_map_shape.rotation();
  const Eigen::Vector3d half = half_extents(shape);
  Footprint f;
  // The heading of the flattest axis; arbitrary for shapes that are round about z.
  const Eigen::Vector3d flat = std::abs(R(2, 0)) <= std::abs(R(2, 1)) ? R.col(0) : Eigen::Vector3d(R.col(1));
  f.yaw = std::atan2(flat.y(), flat.x());
  const Eigen::Matrix3d aligned = Eigen::AngleAxisd(-f.yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix() * R;
  Eigen::Vector3d extent = aligned.cwiseAbs() * half;
  const double round = shape.size.x();
  f.corner = 0.01;
  switch (shape.kind) {
    case ShapeKind::box:
      break;
    case ShapeKind::mesh:  // bodies of robots are rounded, and a shadow is soft
      f.corner = 0.7 * extent.head<2>().minCoeff();
      break;
    case ShapeKind::sphere:
      extent.setConstant(round), f.corner = round;
      break;
    case ShapeKind::capsule:
      extent = aligned.col(2).cwiseAbs() * (0.5 * shape.size.z()) + Eigen::Vector3d::Constant(round);
      f.corner = round;
      break;
    case ShapeKind::cylinder: {
      const Eigen::Vector3d a = aligned.col(2);
      for (int i = 0; i < 3; ++i)
        extent[i] = std::abs(a[i]) * half.z() + round * std::sqrt(std::max(0.0, 1 - a[i] * a[i]));
      if (std::abs(a.z()) > 0.7) f.corner = round;
      break;
    }
  }
  f.half = extent.head<2>();
  f.corner = std::min(f.corner, f.half.minCoeff());
  f.centre = T_map_shape.translation().head<2>();
  f.bottom = T_map_shape.translation().z() - extent.z();
  f.top = T_map_shape.translation().z() + extent.z();
  return f;
}

std::size_t entity_index(DrawList& list, const std::string& name) {
  // A body's parts are consecutive: check the last first.
  const auto found = std::find(list.entities.rbegin(), list.entities.rend(), name);
  if (found != list.entities.rend()) return static_cast<std::size_t>(list.entities.rend() - found);
  if (list.entities.size() < kMaxEntities) list.entities.push_back(name);
  return list.entities.size();
}

/// Of vertices in m.
Instance mesh_instance(const Transform<CameraOptical, ShapeFrame>& T_optical_shape, const Material& material,
                       std::size_t entity) {
  return make_instance(T_optical_shape, {Eigen::Vector3f::Ones(), 0.F}, material, entity);
}

/// True where the shape may be visible.
bool add_shape(DrawList& list, const CameraProjection& projection, const Shape& shape,
               const Transform<CameraOptical, ShapeFrame>& T_optical_shape, std::size_t entity) {
  bool seen = false;
  for (std::size_t v = 0; v < projection.views().size(); ++v) {
    const PixelRect rect = projected_box(projection.views()[v], T_optical_shape, half_extents(shape));
    if (rect.empty()) continue;
    list.view_rects[v] = list.view_rects[v].united(rect);
    seen = true;
  }
  if (!seen) return false;
  const double radius = bounding_radius(shape);
  const double distance = T_optical_shape.translation().norm();
  list.farthest = std::max(list.farthest, distance + radius);
  if (shape.kind == ShapeKind::mesh) {
    list.shape_meshes.push_back({shape.mesh, mesh_instance(T_optical_shape, shape.material, entity)});
    return true;
  }
  const double pixels_per_metre = projection.views().front().fx / std::max(distance - radius, 2 * kNearPlane);
  const bool rounded = shape.kind == ShapeKind::sphere || shape.kind == ShapeKind::capsule;
  const bool bevelled = rounded || edge_bevel(shape) * pixels_per_metre > kVisibleBevel;
  const int level = shape.kind == ShapeKind::box ? 0 : level_for(shape.size.x() * pixels_per_metre);
  list.shapes[mesh_index(shape.kind, level, bevelled)].push_back(
      make_instance(T_optical_shape, shape_scale(shape, bevelled), shape.material, entity));
  return true;
}

}  // namespace

void add_shadow(const ShadowView& view, const Shape& shape, const Transform<Map, ShapeFrame>& T_map_shape,
                std::vector<ShadowVertex>& shadows, std::vector<PixelRect>& view_rects) {
  const Footprint f = footprint(shape, T_map_shape);
  const Transform<CameraOptical, Map> T_optical_map = view.T_map_optical.inverse();
  const double floor_z = view.floor_z, strength = view.strength;
  const double height = std::max(0.0, f.bottom - floor_z);
  if (height > kShadowHeight || f.top < floor_z || view.T_map_optical.translation().z() < floor_z) return;
  const double softness = std::clamp(0.25 * (f.top - floor_z), 0.06, 0.16) + 0.3 * height;
  ShadowVertex vertex{};
  vertex.half[0] = static_cast<float>(f.half.x()), vertex.half[1] = static_cast<float>(f.half.y());
  vertex.corner = static_cast<float>(f.corner);
  vertex.softness = static_cast<float>(softness);
  vertex.contact = static_cast<float>(strength * 0.5 * std::exp(-height / 0.06));
  vertex.ambient = static_cast<float>(strength * 0.42 * std::exp(-height / 0.35) *
                                      std::min(1.0, std::sqrt(f.half.x() * f.half.y()) / (0.7 * softness)));
  std::array<ShadowVertex, 4> corners;
  std::array<Eigen::Vector3d, 4> points;
  const Eigen::Rotation2Dd turn(f.yaw);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d side((i == 1 || i == 2) ? 1 : -1, i >= 2 ? 1 : -1);
    const Eigen::Vector2d local = side.cwiseProduct(f.half + Eigen::Vector2d::Constant(softness));
    const Eigen::Vector2d p = f.centre + turn * local;
    points[i] = T_optical_map * Eigen::Vector3d(p.x(), p.y(), floor_z);
    corners[i] = vertex;
    for (int k = 0; k < 3; ++k) corners[i].position[k] = static_cast<float>(points[i][k]);
    for (int k = 0; k < 2; ++k) corners[i].local[k] = static_cast<float>(local[k]);
  }
  static const std::vector<std::pair<int, int>> edges = {{0, 1}, {1, 2}, {2, 3}, {3, 0}};
  bool seen = false;
  for (std::size_t v = 0; v < view.projection.views().size(); ++v) {
    const PixelRect rect = projected_hull(view.projection.views()[v], points, edges);
    if (rect.empty()) continue;
    view_rects[v] = view_rects[v].united(rect);
    seen = true;
  }
  if (seen)
    for (const std::size_t i : {0U, 1U, 2U, 0U, 2U, 3U}) shadows.push_back(corners[i]);
}

bool DrawList::empty() const {
  return std::all_of(view_rects.begin(), view_rects.end(), [](const PixelRect& r) { return r.empty(); });
}

void DrawList::clear(std::size_t views) {
  for (auto& bucket : shapes) bucket.clear();
  shape_meshes.clear();
  shadows.clear();
  occluders.clear();
  occluder_meshes.clear();
  mesh_chunks.clear();
  mesh_shown.clear();
  entities.clear();
  view_rects.assign(views, {});
  farthest = 0;
}

PixelRect projected_box(const PinholeView& view, const Transform<CameraOptical, ShapeFrame>& T_optical_shape,
                        const Eigen::Vector3d& half) {
  std::array<Eigen::Vector3d, 8> corners;
  for (int i = 0; i < 8; ++i)
    corners[static_cast<std::size_t>(i)] =
        T_optical_shape * Eigen::Vector3d((i & 1) ? half.x() : -half.x(), (i & 2) ? half.y() : -half.y(),
                                          (i & 4) ? half.z() : -half.z());
  return projected_hull(view, corners, box_edges());
}

Instance make_instance(const Transform<CameraOptical, ShapeFrame>& T_optical_shape, const ShapeScale& scale,
                       const Material& material, std::size_t entity) {
  Instance instance;
  const Eigen::Matrix3f R = T_optical_shape.rotation().cast<float>();
  std::copy_n(R.data(), 9, instance.rotation);
  const Eigen::Vector3f t = T_optical_shape.translation().cast<float>();
  std::copy_n(t.data(), 3, instance.translation);
  std::copy_n(scale.scale.data(), 3, instance.scale);
  instance.bevel = scale.bevel;
  std::copy_n(material.albedo.data(), 3, instance.albedo);
  instance.roughness = std::clamp(material.roughness, 0.08F, 1.F);
  instance.metallic = std::clamp(material.metallic, 0.F, 1.F);
  instance.entity = static_cast<float>(entity);
  return instance;
}

namespace {

/// True where a lower part of the same body covers the shape's whole footprint: its shadow would be inside
/// the other's.
bool sheltered(const BodyDefinition& body, const Shape& shape, const Transform<Map, Body>& T_map_body) {
  const Footprint f = footprint(shape, T_map_body * shape.T_body_shape);
  return std::any_of(body.shapes.begin(), body.shapes.end(), [&](const Shape& other) {
    if (&other == &shape) return false;
    const Footprint o = footprint(other, T_map_body * other.T_body_shape);
    if (o.bottom > f.bottom - 1e-6) return false;
    const Eigen::Vector2d offset = (Eigen::Rotation2Dd(-o.yaw) * (f.centre - o.centre)).cwiseAbs();
    const double reach = f.half.norm();
    return offset.x() + reach < o.half.x() + 0.05 && offset.y() + reach < o.half.y() + 0.05;
  });
}

}  // namespace

void add_bodies(DrawList& list, const CameraProjection& projection,
                const Transform<Map, CameraOptical>& T_map_optical, const WorldSnapshot& world,
                const std::function<bool(const BodyDefinition&)>& drawn, const double* floor_z) {
  const Transform<CameraOptical, Map> T_optical_map = T_map_optical.inverse();
  for_each_body(world, [&](const BodyDefinition& body, const BodyState& state) {
    if (!drawn(body) || !state.T_map_body.finite()) return;
    const std::size_t entity = entity_index(list, body.entity);
    for (const Shape& shape : body.shapes) {
      if (!shape.size.allFinite() || !shape.T_body_shape.finite()) continue;
      const Transform<Map, ShapeFrame> T_map_shape = state.T_map_body * shape.T_body_shape;
      add_shape(list, projection, shape, T_optical_map * T_map_shape, entity);
      if (!floor_z || sheltered(body, shape, state.T_map_body)) continue;
      const std::size_t before = list.shadows.size();
      add_shadow({projection, T_map_optical, *floor_z}, shape, T_map_shape, list.shadows, list.view_rects);
      for (std::size_t i = before; i < list.shadows.size(); ++i)
        list.farthest =
            std::max(list.farthest,
                     static_cast<double>(Eigen::Map<const Eigen::Vector3f>(list.shadows[i].position).norm()));
    }
  });
}

namespace {

/// Whether a box (half extents, m) may be in front of something drawn.
bool may_occlude(const DrawList& list, const CameraProjection& projection,
                 const Transform<CameraOptical, ShapeFrame>& T_optical_box, const Eigen::Vector3d& half) {
  // The box's nearest point, by clamping the camera's centre to it.
  const Eigen::Vector3d centre = T_optical_box.inverse().translation();
  const Eigen::Vector3d nearest = centre.cwiseMax(-half).cwiseMin(half);
  if ((centre - nearest).norm() > list.farthest) return false;
  for (std::size_t v = 0; v < projection.views().size(); ++v) {
    const PixelRect rect = projected_box(projection.views()[v], T_optical_box, half);
    if (!rect.intersected(list.view_rects[v]).empty()) return true;
  }
  return false;
}

}  // namespace

void add_occluder(DrawList& list, const CameraProjection& projection,
                  const Transform<CameraOptical, ShapeFrame>& T_optical_box, const Eigen::Vector3d& half) {
  if (may_occlude(list, projection, T_optical_box, half))
    list.occluders.push_back(make_instance(T_optical_box, {half.cast<float>(), 0.F}, Material{}, 0));
}

void add_occluder(DrawList& list, const CameraProjection& projection,
                  const Transform<CameraOptical, ShapeFrame>& T_optical_shape, const Shape& shape) {
  if (may_occlude(list, projection, T_optical_shape, shape.size / 2))
    list.occluder_meshes.push_back({shape.mesh, mesh_instance(T_optical_shape, Material{}, 0)});
}

std::vector<std::uint32_t> seen_chunks(const CameraProjection& projection,
                                       const Transform<Map, CameraOptical>& T_map_optical,
                                       const BuildingMesh& mesh, const std::vector<PixelRect>& rects,
                                       double farthest) {
  std::vector<std::uint32_t> seen;
  const Transform<CameraOptical, Map> T_optical_map = T_map_optical.inverse();
  for (std::uint32_t i = 0; i < mesh.chunks.size(); ++i) {
    const Eigen::AlignedBox3d& box = mesh.chunks[i].box;
    if (box.exteriorDistance(T_map_optical.translation()) > farthest) continue;
    const auto T_optical_box =
        T_optical_map * Transform<Map, ShapeFrame>(Eigen::Quaterniond::Identity(), box.center());
    bool met = false;
    for (std::size_t v = 0; v < projection.views().size() && !met; ++v) {
      const PixelRect rect = projected_box(projection.views()[v], T_optical_box, box.sizes() / 2);
      met = !rect.intersected(rects[v]).empty();
    }
    if (met) seen.push_back(i);
  }
  return seen;
}

Instance mesh_instance(const Transform<Map, CameraOptical>& T_map_optical, const Material& material) {
  // The mesh's own frame is the map.
  return mesh_instance(T_map_optical.inverse().as<CameraOptical, ShapeFrame>(), material, 0);
}

void add_mesh_occluders(DrawList& list, const CameraProjection& projection,
                        const Transform<Map, CameraOptical>& T_map_optical, const BuildingMesh& mesh) {
  if (mesh.chunks.empty()) return;
  list.mesh_chunks = seen_chunks(projection, T_map_optical, mesh, list.view_rects, list.farthest);
  list.mesh = mesh_instance(T_map_optical, Material{});
}

}  // namespace parhelion::render
