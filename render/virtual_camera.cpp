#include <algorithm>
#include <array>
#include <cmath>
#include <list>
#include <opencv2/core.hpp>
#include <optional>
#include <set>

#include "protocols/sha256.hpp"
#include "render/compositor.hpp"
#include "render/egl_scene.hpp"
#include "render/jpeg.hpp"
#include "render/notice.hpp"
#include "render/occluders.hpp"
#include "render/pixel_noise.hpp"
#include "render/textured_camera.hpp"

namespace parhelion::render {
namespace {

constexpr double kSight = 120;   ///< m, walls beyond are in the haze
constexpr int kQuality = 88;     ///< of the JPEG
constexpr double kMoved = 0.02;  ///< m and rad: from its place in the model, and therefore in the texture

/// Linear RGB of the building's materials, by label.
Eigen::Vector3f colour_of(EntityLabel label) {
  switch (label) {
    case EntityLabel::wall:
    case EntityLabel::wall_above_door:
      return {0.72F, 0.69F, 0.63F};
    case EntityLabel::floor:
      return {0.30F, 0.29F, 0.28F};
    case EntityLabel::ceiling:
      return {0.78F, 0.78F, 0.77F};
    case EntityLabel::door:
      return {0.36F, 0.21F, 0.11F};
    case EntityLabel::stairs:
      return {0.42F, 0.42F, 0.44F};
    case EntityLabel::ramp:
      return {0.36F, 0.36F, 0.36F};
    case EntityLabel::window:
      return {0.45F, 0.62F, 0.72F};
    case EntityLabel::pillar:
      return {0.55F, 0.55F, 0.57F};
    case EntityLabel::unknown:
    case EntityLabel::free_space:
      break;
  }
  return {0.46F, 0.50F, 0.46F};
}

struct BuildingPart {
  std::string name;
  EntityLabel label;
  Transform<Map, ShapeFrame> T_map_box;
  Shape shape;
  bool in_texture = false;  ///< shown by the recorded surface as long as it stands in its place
};

bool is_at(const Transform<Map, ShapeFrame>& place, const Transform<Map, ShapeFrame>& now) {
  const Transform<ShapeFrame, ShapeFrame> between = place.inverse() * now;
  return between.translation().norm() < kMoved && Eigen::AngleAxisd(between.rotation()).angle() < kMoved;
}

class EglVirtualCamera : public VirtualCamera {
 public:
  static Result<std::unique_ptr<VirtualCamera>> make(const SemanticModel& building,
                                                     const SiteTexture* texture) {
    auto scene = EglScene::open();
    if (!scene) return scene.error();
    auto camera = std::make_unique<EglVirtualCamera>();
    camera->scene_ = std::move(*scene);
    for (const ModelEntity& entity : building.entities) {
      if (entity.is_virtual || !is_solid(entity) || !entity.T_map_body.finite() || !entity.size.allFinite() ||
          entity.size.minCoeff() <= 0)
        continue;
      BuildingPart part{entity.name, entity.label, T_map_box(entity), {}};
      part.shape.size = entity.size;
      part.shape.material.albedo = colour_of(entity.label);
      part.in_texture = texture != nullptr && !is_left_out_of_texture(entity);
      camera->parts_.push_back(std::move(part));
    }
    camera->floor_z_ = floor_of(building);
    if (texture != nullptr) {
      if (const Status status = camera->set_texture(*texture); !status) return status.error();
      return std::unique_ptr<VirtualCamera>(std::move(camera));
    }
    camera->scene_.set_building(building);
    return std::unique_ptr<VirtualCamera>(std::move(camera));
  }

  Image render(const CameraDescription& camera, const Transform<Map, CameraOptical>& T_map_optical,
               const WorldSnapshot& world, SensorTime stamp, const std::string& stand_in,
               const Exposure& exposure) override;

 private:
  Status set_texture(const SiteTexture& texture);
  void list_scenery(const CameraProjection& projection, const WorldSnapshot& world);
  Eigen::Vector3f factors() const;
  void copy_picture(int width);
  void add_part(const CameraProjection& projection, const Shape& shape,
                const Transform<Map, ShapeFrame>& T_map_shape, EntityLabel label);
  const CameraProjection& projection(const CameraIntrinsics& intrinsics);

  EglScene scene_;
  std::vector<BuildingPart> parts_;
  BuildingMesh site_;  ///< only chunks: of the recorded surface
  std::optional<AutoExposure> recorded_;
  std::string texture_id_;
  double floor_z_ = 0;
  std::list<CameraProjection> projections_;
  JpegCodec codec_;
  std::optional<PixelNoise> noise_;
  DrawList list_;
  Scenery scenery_;
  Layer layer_;
  std::vector<std::uint8_t> bgr_;
};

const CameraProjection& EglVirtualCamera::projection(const CameraIntrinsics& c) {
  for (const CameraProjection& p : projections_) {
    const CameraIntrinsics& k = p.intrinsics();
    if (k.width == c.width && k.height == c.height && k.fx == c.fx && k.fy == c.fy && k.cx == c.cx &&
        k.cy == c.cy && k.lens == c.lens && k.distortion == c.distortion)
      return p;
  }
  if (projections_.size() >= 4) projections_.pop_back();
  projections_.emplace_front(c);
  return projections_.front();
}

Status EglVirtualCamera::set_texture(const SiteTexture& texture) {
  const auto picture = site_picture(texture);
  if (!picture) return picture.error();
  SiteSurface surface = site_surface(texture);
  scene_.renderer->set_site(surface, *picture);
  site_ = std::move(surface.mesh);
  recorded_ = texture.exposure;
  Sha256 hash;
  hash.add(texture.jpeg);
  texture_id_ = hash.hex().substr(0, 16);
  scenery_.recorded = true;
  return {};
}

/// Of the exposure, from what of the recorded surface is in view.
Eigen::Vector3f EglVirtualCamera::factors() const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (std::size_t i = 0; i < layer_.depth_id.size(); ++i) {
    const std::uint8_t* p = &layer_.rgba[4 * i];
    if (p[3] != kRecordedAlpha || layer_.depth_id[i] != 0) continue;
    sum += Eigen::Vector3d(p[0], p[1], p[2]);
    count += 1;
  }
  if (count == 0) return Eigen::Vector3f::Ones();
  return exposure_factors(*recorded_, (sum / count).cast<float>());
}

/// To BGR; with a recorded site as bright as its camera would have shown it.
void EglVirtualCamera::copy_picture(int width) {
  std::array<std::array<std::uint8_t, 256>, 3> exposed;
  const Eigen::Vector3f factor = recorded_ ? factors() : Eigen::Vector3f::Ones();
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t value = 0; value < 256; ++value)
      exposed[c][value] = static_cast<std::uint8_t>(
          std::lround(std::min(255.F, factor[static_cast<Eigen::Index>(c)] * static_cast<float>(value))));
  for (int y = layer_.rect.y0; y < layer_.rect.y1; ++y) {
    for (int x = layer_.rect.x0; x < layer_.rect.x1; ++x) {
      const std::uint8_t* in = &layer_.rgba[4 * layer_.at(x, y)];
      std::uint8_t* out = &bgr_[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                     static_cast<std::size_t>(x))];
      out[0] = exposed[2][in[2]], out[1] = exposed[1][in[1]], out[2] = exposed[0][in[0]];
    }
  }
}

void EglVirtualCamera::add_part(const CameraProjection& camera, const Shape& shape,
                                const Transform<Map, ShapeFrame>& T_map_shape, EntityLabel label) {
  const Transform<CameraOptical, ShapeFrame> T_optical_shape = scenery_.T_map_optical.inverse() * T_map_shape;
  const Eigen::Vector3d half = half_extents(shape);
  const bool seen = std::any_of(camera.views().begin(), camera.views().end(), [&](const PinholeView& view) {
    return !projected_box(view, T_optical_shape, half).empty();
  });
  if (!is_ground(label) && label != EntityLabel::ceiling && label != EntityLabel::window &&
      T_optical_shape.translation().norm() < kSight) {
    std::vector<PixelRect> ignored(camera.views().size());
    add_shadow({camera, scenery_.T_map_optical, floor_z_, 0.6}, shape, T_map_shape, scenery_.shadows,
               ignored);
  }
  if (!seen) return;
  Instance instance = make_instance(T_optical_shape, {half.cast<float>(), 0.F}, shape.material, 0);
  instance.metallic = label == EntityLabel::window ? 0.3F : 1.F;
  instance.roughness = is_ground(label) ? 2.F : 0.85F;
  (label == EntityLabel::window ? scenery_.glass : scenery_.boxes).push_back(instance);
}

void EglVirtualCamera::list_scenery(const CameraProjection& camera, const WorldSnapshot& world) {
  scenery_.boxes.clear();
  scenery_.glass.clear();
  scenery_.shadows.clear();
  scenery_.floor_z = floor_z_;
  std::set<std::string> moved;  // doors at their current angles
  for_each_body(world, [&](const BodyDefinition& body, const BodyState& state) {
    if (body.owner != BodyOwner::building || body.injectable) return;
    moved.insert(body.entity);
    const auto part =
        std::find_if(parts_.begin(), parts_.end(), [&](const auto& p) { return p.name == body.entity; });
    const EntityLabel label = part == parts_.end() ? EntityLabel::unknown : part->label;
    if (part != parts_.end() && part->in_texture && !body.shapes.empty() &&
        is_at(part->T_map_box, state.T_map_body * body.shapes.front().T_body_shape))
      return;
    for (Shape shape : body.shapes) {
      shape.material.albedo = colour_of(label);
      add_part(camera, shape, state.T_map_body * shape.T_body_shape, label);
    }
  });
  for (const BuildingPart& part : parts_)
    if (!part.in_texture && !moved.count(part.name)) add_part(camera, part.shape, part.T_map_box, part.label);
}

Image EglVirtualCamera::render(const CameraDescription& description,
                               const Transform<Map, CameraOptical>& T_map_optical, const WorldSnapshot& world,
                               SensorTime stamp, const std::string& stand_in, const Exposure& exposure) {
  Image image;
  image.stamp = stamp;
  const auto intrinsics = intrinsics_for_size(description.intrinsics, description.intrinsics.width,
                                              description.intrinsics.height);
  if (!intrinsics || !T_map_optical.finite()) return image;
  const CameraProjection& camera = projection(*intrinsics);
  const Eigen::Vector3d eye = T_map_optical.translation();
  scenery_.T_map_optical = T_map_optical;
  list_scenery(camera, world);
  std::set<std::string> carriers;
  if (!exposure.shows_carrier)
    for_each_body(world, [&](const BodyDefinition& body, const BodyState& state) {
      if (body.owner != BodyOwner::building && carries_camera(body, state.T_map_body, eye))
        carriers.insert(body.entity);
    });
  list_.clear(camera.views().size());
  add_bodies(
      list_, camera, T_map_optical, world,
      [&](const BodyDefinition& body) {
        if (body.owner == BodyOwner::building && !body.injectable) return false;
        return !(carriers.count(body.entity) || (body.injectable && !stand_in.empty()));
      },
      &floor_z_);
  list_.farthest = std::max(list_.farthest, kSight);
  for (std::size_t v = 0; v < camera.views().size(); ++v)
    list_.view_rects[v] = camera.view_rect(v, {0, 0, intrinsics->width, intrinsics->height});
  Material material;
  material.albedo = colour_of(EntityLabel::unknown);
  material.roughness = 0.85F;
  scenery_.mesh = mesh_instance(T_map_optical, material);
  scenery_.mesh.metallic = 1;  // opaque
  scenery_.mesh_chunks = seen_chunks(camera, T_map_optical, scene_.mesh, list_.view_rects, kSight);
  if (recorded_) scenery_.site_chunks = seen_chunks(camera, T_map_optical, site_, list_.view_rects, kSight);
  scene_.renderer->draw(camera, list_, T_map_optical.rotation().transpose(), false, &scenery_);
  if (!scene_.renderer->read(camera, list_, layer_)) return image;

  bgr_.assign(3 * static_cast<std::size_t>(intrinsics->width) * static_cast<std::size_t>(intrinsics->height),
              0);
  copy_picture(intrinsics->width);
  if (exposure.noise > 0) {
    if (!noise_ || noise_->sigma() != exposure.noise) noise_.emplace(exposure.noise);
    noise_->add(exposure.seed, exposure.sequence, bgr_);
  }
  if (!stand_in.empty()) {
    cv::Mat picture(intrinsics->height, intrinsics->width, CV_8UC3, bgr_.data());
    write_notice("STAND-IN CAMERA: rendered from the model", picture);
    image.metadata.push_back({"stand-in", {stand_in.begin(), stand_in.end()}});
  }
  if (recorded_) image.metadata.push_back({"texture", {texture_id_.begin(), texture_id_.end()}});
  auto jpeg =
      codec_.encode(bgr_, {intrinsics->width, intrinsics->height, kQuality, JpegFormat::Subsampling::yuv420});
  if (!jpeg) return image;
  image.width = intrinsics->width, image.height = intrinsics->height;
  image.bytes = std::move(*jpeg);
  return image;
}

}  // namespace

Result<std::unique_ptr<VirtualCamera>> VirtualCamera::create(const SemanticModel& building) {
  return create_virtual_camera(building, nullptr);
}

Result<std::unique_ptr<VirtualCamera>> create_virtual_camera(const SemanticModel& building,
                                                             const SiteTexture* texture) {
  return EglVirtualCamera::make(building, texture);
}

}  // namespace parhelion::render
