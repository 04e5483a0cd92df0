#include "fusion/scan/building_tree.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <vector>

#include "fusion/scan/shape_intersection.hpp"

namespace parhelion::scan {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Box {
  Matrix3d R_box_map;
  Vector3d center, half;
  float reflectivity;
};

struct Triangle {
  std::array<Eigen::Vector3f, 3> corners;  ///< map, m
};

/// Embree's rays are floats; the exact double rays are passed along, so that the result does not depend on
/// the map's origin.
struct Query {
  RTCIntersectContext context;
  Vector3d origin, direction;
  double range;
  float reflectivity;
};

struct ReleaseDevice {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct ReleaseScene {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};

}  // namespace

struct BuildingTree::Scene {
  std::unique_ptr<RTCDeviceTy, ReleaseDevice> device;
  std::unique_ptr<RTCSceneTy, ReleaseScene> scene;
  std::vector<Box> boxes;
  std::vector<Triangle> triangles;     ///< primitives after the boxes
  Vector3d center = Vector3d::Zero();  ///< map, m: the tree's floats are relative to it

  static void bounds(const RTCBoundsFunctionArguments* args);
  static void intersect(const RTCIntersectFunctionNArguments* args);
  void add(const ModelEntity& entity);
  void add(const ModelMesh& mesh);
  void extent(unsigned primitive, Vector3d& low, Vector3d& high) const;
  void build();
};

void BuildingTree::Scene::bounds(const RTCBoundsFunctionArguments* args) {
  const auto& self = *static_cast<const Scene*>(args->geometryUserPtr);
  Vector3d low, high;
  self.extent(args->primID, low, high);
  // Floats have an error of 0.1 mm at a kilometre; boxes are grown by a millimetre so that no test misses
  // one.
  low -= self.center + Vector3d::Constant(1e-3);
  high -= self.center - Vector3d::Constant(1e-3);
  RTCBounds& out = *args->bounds_o;
  out.lower_x = static_cast<float>(low.x()), out.upper_x = static_cast<float>(high.x());
  out.lower_y = static_cast<float>(low.y()), out.upper_y = static_cast<float>(high.y());
  out.lower_z = static_cast<float>(low.z()), out.upper_z = static_cast<float>(high.z());
}

void BuildingTree::Scene::intersect(const RTCIntersectFunctionNArguments* args) {
  if (args->valid[0] == 0) return;
  const auto& self = *static_cast<const Scene*>(args->geometryUserPtr);
  auto& query = *reinterpret_cast<Query*>(args->context);
  double range = 0;
  float reflectivity = kMeshReflectivity;
  if (args->primID < self.boxes.size()) {
    const Box& box = self.boxes[args->primID];
    const Vector3d origin = box.R_box_map * (query.origin - box.center);
    range = box_chord(origin, box.R_box_map * query.direction, box.half).range();
    reflectivity = box.reflectivity;
  } else {
    const auto& [a, b, c] = self.triangles[args->primID - self.boxes.size()].corners;
    range =
        triangle_range(query.origin, query.direction, a.cast<double>(), b.cast<double>(), c.cast<double>());
  }
  if (!(range < query.range)) return;
  query.range = range;
  query.reflectivity = reflectivity;
  // Further boxes must be nearer than this, with a small margin as the tree is in floats.
  auto& ray = *reinterpret_cast<RTCRayHit*>(args->rayhit);
  ray.ray.tfar = std::min(ray.ray.tfar, static_cast<float>(range) + 2e-3F);
}

void BuildingTree::Scene::add(const ModelEntity& entity) {
  if (entity.is_virtual || !is_solid(entity) || !entity.T_map_body.finite() || !entity.size.allFinite())
    return;
  boxes.push_back({entity.T_map_body.rotation().transpose(), entity.T_map_body.translation(), entity.size / 2,
                   entity.material.laser_reflectivity});
}

void BuildingTree::Scene::add(const ModelMesh& mesh) {
  for (const auto& [a, b, c] : mesh.triangles) {
    if (std::max({a, b, c}) >= mesh.vertices.size()) continue;
    const Triangle triangle{{mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]}};
    if (triangle.corners[0].allFinite() && triangle.corners[1].allFinite() && triangle.corners[2].allFinite())
      triangles.push_back(triangle);
  }
}

void BuildingTree::Scene::extent(unsigned primitive, Vector3d& low, Vector3d& high) const {
  if (primitive < boxes.size()) {
    const Box& box = boxes[primitive];
    const Vector3d reach = box.R_box_map.transpose().cwiseAbs() * box.half;
    low = box.center - reach;
    high = box.center + reach;
    return;
  }
  const auto& [a, b, c] = triangles[primitive - boxes.size()].corners;
  low = a.cwiseMin(b).cwiseMin(c).cast<double>();
  high = a.cwiseMax(b).cwiseMax(c).cast<double>();
}

void BuildingTree::Scene::build() {
  const auto count = static_cast<unsigned>(boxes.size() + triangles.size());
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (unsigned i = 0; i < count; ++i) {
    Vector3d from, to;
    extent(i, from, to);
    low = low.cwiseMin(from);
    high = high.cwiseMax(to);
  }
  center = (low + high) / 2;
  device.reset(rtcNewDevice("threads=1"));
  if (!device)
    throw std::runtime_error("Embree cannot create a device; is libembree3 complete for this CPU?");
  scene.reset(rtcNewScene(device.get()));
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, count);
  rtcSetGeometryUserData(geometry, this);
  rtcSetGeometryBoundsFunction(geometry, bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, intersect);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene.get(), geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene.get());
}

BuildingTree::BuildingTree() = default;
BuildingTree::~BuildingTree() = default;
BuildingTree::BuildingTree(BuildingTree&&) noexcept = default;
BuildingTree& BuildingTree::operator=(BuildingTree&&) noexcept = default;

BuildingTree::BuildingTree(const SemanticModel& model, Doors doors) : scene_(std::make_unique<Scene>()) {
  for (const ModelEntity& entity : model.entities) {
    if (doors == Doors::as_drawn || entity.label != EntityLabel::door) scene_->add(entity);
  }
  for (const ModelMesh& mesh : model.meshes) scene_->add(mesh);
  if (scene_->boxes.empty() && scene_->triangles.empty()) {
    scene_.reset();
    return;
  }
  scene_->build();
}

BuildingTree::Hit BuildingTree::cast(const Vector3d& origin, const Vector3d& direction,
                                     double max_range) const {
  if (!scene_) return {};
  Query query{{}, origin, direction, std::numeric_limits<double>::infinity(), 0};
  rtcInitIntersectContext(&query.context);
  const Eigen::Vector3f from = (origin - scene_->center).cast<float>(), along = direction.cast<float>();
  RTCRayHit ray{};
  ray.ray.org_x = from.x(), ray.ray.org_y = from.y(), ray.ray.org_z = from.z();
  ray.ray.dir_x = along.x(), ray.ray.dir_y = along.y(), ray.ray.dir_z = along.z();
  ray.ray.tnear = 0;
  ray.ray.tfar = static_cast<float>(max_range) + 2e-3F;
  ray.ray.mask = ~0U;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_->scene.get(), &query.context, &ray);
  return {query.range, query.reflectivity};
}

}  // namespace parhelion::scan
