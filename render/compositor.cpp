#include "render/compositor.hpp"

#include <algorithm>
#include <chrono>
#include <list>

#include "render/depth_image.hpp"
#include "render/depth_occlusion.hpp"
#include "render/egl_scene.hpp"
#include "render/occluders.hpp"
#include "render/pixels.hpp"

namespace parhelion::render {
namespace {

/// Measures stages; the clock is used only for timings.
class Stopwatch {
 public:
  Duration lap() {
    const auto now = std::chrono::steady_clock::now();
    const auto span = std::chrono::duration_cast<std::chrono::nanoseconds>(now - last_);
    last_ = now;
    return {span.count()};
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

bool injectable(const BodyDefinition& body) { return body.injectable; }

bool has_injectable(const WorldSnapshot& world) {
  return world.scene && !world.bodies.empty() &&
         std::any_of(world.scene->bodies.begin(), world.scene->bodies.end(),
                     [](const auto& body) { return body->injectable; });
}

/// A stand-in picture shows only the model, so only the model occludes.
bool is_stand_in(const Image& image) { return image.find_metadata("stand-in") != nullptr; }

class EglCompositor : public Compositor {
 public:
  static Result<std::unique_ptr<Compositor>> make(const SemanticModel& building) {
    auto scene = EglScene::open();
    if (!scene) return scene.error();
    auto compositor = std::make_unique<EglCompositor>();
    compositor->scene_ = std::move(*scene);
    compositor->building_ = occluders_of(building);
    compositor->scene_.set_building(building);
    return std::unique_ptr<Compositor>(std::move(compositor));
  }

  RenderAnswer compose(const RenderJob& job) override;
  Result<Pixels> compose_pixels(const RenderJob& job) override;

 private:
  /// Result of a job: nothing to draw, or `frame_` and `layer_` are composited.
  enum class Outcome { nothing, drawn };
  Result<Outcome> draw(const RenderJob& job, RenderTimings& timings);
  void read_depth_image(const RenderJob& job);
  const CameraProjection& projection(const CameraIntrinsics& intrinsics);
  void list_bodies(const RenderJob& job, const CameraProjection& camera,
                   const Transform<Map, CameraOptical>& T_map_optical, bool shadows);
  void list_occluders(const RenderJob& job, const CameraProjection& camera,
                      const Transform<Map, CameraOptical>& T_map_optical);
  Result<std::optional<Image>> draw_depth(const RenderJob& job);
  std::vector<std::string> visible_entities() const;

  EglScene scene_;
  std::vector<OccluderBox> building_;
  std::list<CameraProjection> projections_;  ///< newest first; a warp map is computed once per camera
  JpegCodec codec_;
  DrawList bodies_;
  Layer layer_, modelled_;
  BgrFrame frame_;
  DepthOcclusion depth_occlusion_;
  Result<DepthPixels> depth_ = Error{"no depth image"};
  CameraIntrinsics depth_intrinsics_;
  bool depth_is_read_ = false;   ///< of the current job: by draw(), which needs it first
  bool depth_is_drawn_ = false;  ///< of the current job: its depth image has changed
};

bool same(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx &&
         a.cy == b.cy && a.lens == b.lens && a.distortion == b.distortion;
}

const CameraProjection& EglCompositor::projection(const CameraIntrinsics& intrinsics) {
  const auto found = std::find_if(projections_.begin(), projections_.end(), [&](const CameraProjection& p) {
    return same(p.intrinsics(), intrinsics);
  });
  if (found != projections_.end()) {
    projections_.splice(projections_.begin(), projections_, found);  // so that it is not dropped next
    return *found;
  }
  if (projections_.size() >= 4) projections_.pop_back();
  projections_.emplace_front(intrinsics);
  return projections_.front();
}

void EglCompositor::list_bodies(const RenderJob& job, const CameraProjection& camera,
                                const Transform<Map, CameraOptical>& T_map_optical, bool shadows) {
  bodies_.clear(camera.views().size());
  add_bodies(bodies_, camera, T_map_optical, job.world, injectable, shadows ? &job.floor_z : nullptr);
}

void EglCompositor::list_occluders(const RenderJob& job, const CameraProjection& camera,
                                   const Transform<Map, CameraOptical>& T_map_optical) {
  add_occluders(bodies_, camera, T_map_optical, building_, job.world);
  add_mesh_occluders(bodies_, camera, T_map_optical, scene_.mesh);
  if (!job.scan || is_stand_in(job.image) || !job.T_map_laser.finite()) return;
  const Transform<CameraOptical, Map> T_optical_map = T_map_optical.inverse();
  for (const OccluderBox& strip :
       scan_occluders(*job.scan, job.laser, job.T_map_laser, job.floor_z, T_map_optical.translation(),
                      bodies_.farthest, explaining_boxes(building_, job.world)))
    add_occluder(bodies_, camera, T_optical_map * strip.T_map_box, strip.half);
}

/// Stores the depth image's pixels in `depth_`, or returns why there are none.
void EglCompositor::read_depth_image(const RenderJob& job) {
  depth_ = Error{"no depth image"};
  if (!job.depth) return;
  depth_ = decode_depth(*job.depth);
  if (!depth_) return;
  const auto intrinsics = intrinsics_for_size(job.depth_camera.intrinsics, depth_->width, depth_->height);
  if (!intrinsics)
    depth_ = Error{"depth camera: " + intrinsics.error().message};
  else if (!job.T_map_depth.finite())
    depth_ = Error{"the pose of the depth camera is not finite"};
  else
    depth_intrinsics_ = *intrinsics;
}

Result<EglCompositor::Outcome> EglCompositor::draw(const RenderJob& job, RenderTimings& timings) {
  Stopwatch watch;
  if (!has_injectable(job.world)) return Outcome::nothing;
  if (!job.T_map_optical.finite()) return Error{"the camera's pose is not finite"};
  const auto size = image_size(job.image, codec_);
  if (!size) return size.error();
  const auto intrinsics = intrinsics_for_size(job.camera.intrinsics, size->width, size->height);
  if (!intrinsics) return intrinsics.error();
  const CameraProjection& camera = projection(*intrinsics);
  list_bodies(job, camera, job.T_map_optical, true);
  if (bodies_.empty()) return Outcome::nothing;
  list_occluders(job, camera, job.T_map_optical);
  read_depth_image(job);
  depth_is_read_ = true;
  const Eigen::Matrix3d R_optical_map = job.T_map_optical.rotation().transpose();
  scene_.renderer->draw(camera, bodies_, R_optical_map, !depth_.ok());
  timings.draw = watch.lap();
  // Decoded while the driver draws.
  if (auto status = read_pixels(job.image, codec_, frame_); !status) return status.error();
  timings.decode = watch.lap();
  if (auto status = scene_.renderer->read(camera, bodies_, layer_); !status) return status.error();
  timings.draw = timings.draw + watch.lap();
  if (depth_.ok() && !layer_.rect.empty()) {
    scene_.renderer->read_depth(camera, bodies_, LayerRenderer::Depth::occluders, modelled_);
    depth_occlusion_.apply({*depth_, projection(depth_intrinsics_), job.depth_camera, job.T_map_depth, camera,
                            job.T_map_optical, job.floor_z, frame_.bgr, modelled_},
                           layer_);
  }
  const bool any = has_coverage(layer_) && blend(layer_, frame_);
  timings.composite = watch.lap();
  return any ? Outcome::drawn : Outcome::nothing;
}

std::vector<std::string> EglCompositor::visible_entities() const {
  std::vector<bool> seen(bodies_.entities.size() + 1, false);
  for (std::size_t i = 0; i < layer_.depth_id.size(); ++i)
    if (layer_.depth_id[i] && layer_.rgba[4 * i + 3]) seen[layer_entity(layer_.depth_id[i])] = true;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < bodies_.entities.size(); ++i)
    if (seen[i + 1]) names.push_back(bodies_.entities[i]);
  return names;
}

RenderAnswer EglCompositor::compose(const RenderJob& job) {
  RenderAnswer answer;
  answer.image = job.image;
  depth_is_read_ = depth_is_drawn_ = false;
  const Result<Outcome> outcome = job.image.width == 0 ? Outcome::nothing : draw(job, answer.timings);
  if (!outcome) {
    answer.reason = outcome.error().message;
  } else if (*outcome == Outcome::drawn) {
    Stopwatch watch;
    if (auto status = write_pixels(frame_, layer_, codec_, answer.image); !status) {
      answer.image = job.image;
      answer.reason = status.error().message;
    } else {
      answer.drawn = true;
      answer.visible = visible_entities();
    }
    answer.timings.encode = watch.lap();
  }
  if (auto depth = draw_depth(job); depth.ok()) {
    answer.depth = std::move(*depth);
    answer.depth_drawn = depth_is_drawn_;
  } else {
    if (!job.depth_answered) answer.depth = job.depth;
    if (answer.reason.empty()) answer.reason = depth.error().message;
  }
  return answer;
}

Result<Compositor::Pixels> EglCompositor::compose_pixels(const RenderJob& job) {
  RenderTimings timings;
  depth_is_read_ = false;
  const auto outcome = draw(job, timings);
  if (!outcome) return outcome.error();
  if (*outcome == Outcome::nothing)
    if (auto status = read_pixels(job.image, codec_, frame_); !status) return status.error();
  Pixels pixels{frame_.width, frame_.height, frame_.bgr, {}, {}};
  pixels.mask.assign(static_cast<std::size_t>(frame_.width) * static_cast<std::size_t>(frame_.height), 0);
  pixels.coverage = pixels.mask;
  if (*outcome == Outcome::nothing) return pixels;
  for (int y = layer_.rect.y0; y < layer_.rect.y1; ++y)
    for (int x = layer_.rect.x0; x < layer_.rect.x1; ++x)
      if (const std::uint8_t coverage = layer_.rgba[4 * layer_.at(x, y) + 3]) {
        const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(frame_.width) +
                              static_cast<std::size_t>(x);
        pixels.mask[i] = 255;
        pixels.coverage[i] = coverage;
      }
  return pixels;
}

/// MR_DEPTH: a measured pixel can only become nearer; one without a measurement is set where a body is nearer
/// than the modelled building and within the sensor's range; below the sensor's minimum range it is 0, as the
/// sensor reports it.
Result<std::optional<Image>> EglCompositor::draw_depth(const RenderJob& job) {
  if (!job.depth || job.depth_answered) return std::optional<Image>{};
  if (!has_injectable(job.world)) return std::optional<Image>{*job.depth};
  if (!depth_is_read_) read_depth_image(job);
  if (!depth_) return depth_.error();
  Result<DepthPixels>& pixels = depth_;
  const CameraProjection& camera = projection(depth_intrinsics_);
  // Drawn for the depth camera: its optical frame is the renderer's.
  const auto T_map_optical = job.T_map_depth.as<Map, CameraOptical>();
  list_bodies(job, camera, T_map_optical, false);
  if (bodies_.empty()) return std::optional<Image>{*job.depth};
  list_occluders(job, camera, T_map_optical);
  scene_.renderer->read_depth(camera, bodies_, LayerRenderer::Depth::shapes, layer_);
  scene_.renderer->read_depth(camera, bodies_, LayerRenderer::Depth::occluders, modelled_);
  const double range_max =
      job.depth_camera.range_max > 0 ? std::min(job.depth_camera.range_max, 65.534) : 65.534;
  bool changed = false;
  for (int y = layer_.rect.y0; y < layer_.rect.y1; ++y) {
    for (int x = layer_.rect.x0; x < layer_.rect.x1; ++x) {
      const std::size_t i = layer_.at(x, y);
      if (!layer_.depth_id[i]) continue;
      std::uint16_t& real =
          pixels->millimetres[static_cast<std::size_t>(y) * static_cast<std::size_t>(pixels->width) +
                              static_cast<std::size_t>(x)];
      const double z = layer_depth(layer_.depth_id[i]);
      const std::uint32_t wall = modelled_.depth_id[i];
      if (real == 0 && (z > range_max || (wall && layer_depth(wall) < z - kOcclusionBias))) continue;
      const auto millimetres = static_cast<std::uint16_t>(
          z < job.depth_camera.range_min ? 0 : std::lround(std::min(z, 65.534) * 1000));
      if ((real != 0 && millimetres >= real) || millimetres == real) continue;
      real = millimetres;
      changed = true;
    }
  }
  if (!changed) return std::optional<Image>{*job.depth};
  auto image = encode_depth(*pixels, *job.depth);
  if (!image) return image.error();
  depth_is_drawn_ = true;
  return std::optional<Image>{std::move(*image)};
}

}  // namespace

Result<std::unique_ptr<Compositor>> Compositor::create(const SemanticModel& building) {
  return EglCompositor::make(building);
}

}  // namespace parhelion::render
