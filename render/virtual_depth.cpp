#include "render/virtual_depth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "render/depth_image.hpp"
#include "render/depth_sensor.hpp"
#include "render/egl_scene.hpp"
#include "render/occluders.hpp"

namespace parhelion::render {
namespace {

constexpr double kFloorThickness = 0.1;  // m

bool same(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx &&
         a.cy == b.cy && a.lens == b.lens && a.distortion == b.distortion;
}

class EglVirtualDepthCamera : public VirtualDepthCamera {
 public:
  static Result<std::unique_ptr<VirtualDepthCamera>> make(const SemanticModel& building) {
    auto scene = EglScene::open();
    if (!scene) return scene.error();
    auto camera = std::make_unique<EglVirtualDepthCamera>();
    camera->scene_ = std::move(*scene);
    camera->boxes_ = occluders_of(building);
    camera->floor_z_ = floor_of(building);
    camera->scene_.set_building(building);
    return std::unique_ptr<VirtualDepthCamera>(std::move(camera));
  }

  Image measure(const DepthCameraDescription& camera, const Transform<Map, DepthOptical>& T_map_optical,
                const WorldSnapshot& world, SensorTime stamp, std::uint64_t seed,
                std::uint64_t sequence) override;

 private:
  void list(const Transform<Map, CameraOptical>& T_map_optical, const WorldSnapshot& world, double sight);
  void add_box(const Transform<Map, CameraOptical>& T_map_optical,
               const Transform<Map, ShapeFrame>& T_map_box, const Eigen::Vector3d& half);
  void read_depths(int width, int height);

  EglScene scene_;
  std::vector<OccluderBox> boxes_;
  double floor_z_ = 0;
  std::optional<CameraProjection> projection_;
  DrawList list_;
  Layer layer_;
  std::vector<float> depths_;
  DepthSensor sensor_;
};

void EglVirtualDepthCamera::add_box(const Transform<Map, CameraOptical>& T_map_optical,
                                    const Transform<Map, ShapeFrame>& T_map_box,
                                    const Eigen::Vector3d& half) {
  list_.occluders.push_back(
      make_instance(T_map_optical.inverse() * T_map_box, {half.cast<float>(), 0.F}, Material{}, 0));
}

/// The building as boxes and mesh, a floor up to the camera's range, and all bodies.
void EglVirtualDepthCamera::list(const Transform<Map, CameraOptical>& T_map_optical,
                                 const WorldSnapshot& world, double sight) {
  const CameraProjection& projection = *projection_;
  list_.clear(projection.views().size());
  for (const OccluderBox& box : explaining_boxes(boxes_, world))
    add_box(T_map_optical, box.T_map_box, box.half);
  const Eigen::Vector3d eye = T_map_optical.translation();
  add_box(T_map_optical,
          Transform<Map, ShapeFrame>::planar(eye.x(), eye.y(), 0, floor_z_ - kFloorThickness / 2),
          {sight, sight, kFloorThickness / 2});
  add_bodies(
      list_, projection, T_map_optical, world,
      [](const BodyDefinition& body) { return body.owner != BodyOwner::building || body.injectable; },
      nullptr);
  list_.farthest = std::max(list_.farthest, sight);
  const CameraIntrinsics& k = projection.intrinsics();
  for (std::size_t v = 0; v < projection.views().size(); ++v)
    list_.view_rects[v] = projection.view_rect(v, {0, 0, k.width, k.height});
  list_.mesh = mesh_instance(T_map_optical, Material{});
  list_.mesh_chunks = seen_chunks(projection, T_map_optical, scene_.mesh, list_.view_rects, sight);
}

void EglVirtualDepthCamera::read_depths(int width, int height) {
  depths_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                 std::numeric_limits<float>::infinity());
  for (int y = std::max(layer_.rect.y0, 0); y < std::min(layer_.rect.y1, height); ++y) {
    float* row = depths_.data() + static_cast<std::ptrdiff_t>(y) * width;
    for (int x = std::max(layer_.rect.x0, 0); x < std::min(layer_.rect.x1, width); ++x)
      if (const std::uint32_t word = layer_.depth_id[layer_.at(x, y)])
        row[x] = static_cast<float>(layer_depth(word));
  }
}

Image EglVirtualDepthCamera::measure(const DepthCameraDescription& camera,
                                     const Transform<Map, DepthOptical>& T_map_optical,
                                     const WorldSnapshot& world, SensorTime stamp, std::uint64_t seed,
                                     std::uint64_t sequence) {
  Image image;
  image.stamp = stamp;
  image.format = PixelFormat::depth_mm;
  const int width = camera.intrinsics.width, height = camera.intrinsics.height;
  const auto intrinsics = intrinsics_for_size(camera.intrinsics, width, height);
  if (!intrinsics || !T_map_optical.finite()) return image;
  if (!projection_ || !same(projection_->intrinsics(), *intrinsics)) projection_.emplace(*intrinsics);
  // Drawn for the depth camera: its optical frame is the renderer's. A depth is along the axis: at the
  // picture's edge the range is longer.
  list(T_map_optical.as<Map, CameraOptical>(), world, 2 * farthest_depth(camera));
  scene_.renderer->read_depth(*projection_, list_, LayerRenderer::Depth::everything, layer_);
  if (layer_.rect.empty()) return image;  // creating the frame buffer failed

  read_depths(width, height);
  DepthPixels pixels{width, height, {}};
  sensor_.measure(camera, depths_, seed, sequence, pixels);
  const std::string encoding = "png";
  image.metadata = {{"encoding", {encoding.begin(), encoding.end()}}};
  auto encoded = encode_depth(pixels, image);
  return encoded ? std::move(*encoded) : image;
}

}  // namespace

Result<std::unique_ptr<VirtualDepthCamera>> VirtualDepthCamera::create(const SemanticModel& building) {
  return EglVirtualDepthCamera::make(building);
}

}  // namespace parhelion::render
