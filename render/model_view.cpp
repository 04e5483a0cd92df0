#include "render/model_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "render/egl_context.hpp"
#include "render/layer_renderer.hpp"
#include "render/model_view_camera.hpp"

namespace parhelion::render {
namespace {

constexpr std::uint32_t kMeshEntity = 1023;

struct Paint {
  EntityLabel label;
  const char* words;
  std::array<std::uint8_t, 3> srgb;
};
constexpr std::array<Paint, 10> kPaints{{{EntityLabel::wall, "wall", {205, 208, 214}},
                                         {EntityLabel::wall_above_door, "wall above door", {168, 178, 196}},
                                         {EntityLabel::floor, "floor", {238, 234, 224}},
                                         {EntityLabel::door, "door", {214, 137, 16}},
                                         {EntityLabel::free_space, "free space of a door", {150, 214, 160}},
                                         {EntityLabel::stairs, "stairs", {110, 140, 200}},
                                         {EntityLabel::ramp, "ramp", {186, 199, 222}},
                                         {EntityLabel::window, "window", {84, 174, 255}},
                                         {EntityLabel::pillar, "pillar", {150, 100, 165}},
                                         {EntityLabel::unknown, "unknown (solid)", {196, 164, 124}}}};

const Paint* paint_of(EntityLabel label) {
  const auto* found =
      std::find_if(kPaints.begin(), kPaints.end(), [&](const Paint& p) { return p.label == label; });
  return found == kPaints.end() ? nullptr : found;
}

float linear(std::uint8_t srgb) {
  const double v = srgb / 255.0;
  return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

Material material_of(const Paint& paint) {
  Material material;
  material.albedo = {linear(paint.srgb[0]), linear(paint.srgb[1]), linear(paint.srgb[2])};
  material.roughness = 0.9F;
  return material;
}

/// Walls and their parts across the line of sight, with the camera on one side and the middle of the site on
/// the other, would hide the interior.
bool stands_before(const ModelEntity& e, const Eigen::Vector3d& middle, const ModelViewCamera& camera) {
  switch (e.label) {
    case EntityLabel::wall:
    case EntityLabel::door:
    case EntityLabel::window:
    case EntityLabel::wall_above_door:
      break;
    default:
      return false;
  }
  const Eigen::Vector2d sight = camera.forward.head<2>().normalized();
  const Eigen::Vector2d across = e.T_map_body.rotation().col(1).head<2>();
  const auto side = [&](const Eigen::Vector3d& p) {
    return across.dot((p - e.T_map_body.translation()).head<2>());
  };
  return std::abs(across.dot(sight)) > 0.35 && side(middle) * side(camera.T_map_optical.translation()) < 0;
}

/// The drawn part of an entity; nothing where it is cut away.
std::optional<Shape> shown_part(const ModelEntity& e, double cut_z) {
  Shape shape;
  shape.size = e.size;
  const double bottom = e.T_map_body.translation().z() - e.size.z() / 2;
  if (cut_z < bottom + 0.05) return std::nullopt;
  const double height = std::min(e.size.z(), cut_z - bottom);
  shape.T_body_shape =
      Transform<Body, ShapeFrame>(Eigen::Quaterniond::Identity(), {0, 0, (height - e.size.z()) / 2});
  shape.size.z() = height;
  return shape;
}

class Viewer {
 public:
  Viewer(const SemanticModel& model, const ModelView& view, const Eigen::AlignedBox3d& extent)
      : model_(model),
        view_(view),
        extent_(extent),
        camera_(look_at(model, extent, view)),
        projection_(camera_.intrinsics) {}

  Result<ModelViewPixels> draw() {
    auto context = EglContext::create();
    if (!context) return context.error();
    auto renderer = LayerRenderer::create(**context);
    if (!renderer) return renderer.error();
    list(**renderer);
    (*renderer)->draw(projection_, list_, camera_.T_map_optical.rotation().transpose(), false);
    if (const Status status = (*renderer)->read(projection_, list_, layer_); !status) return status.error();
    compose();
    ModelViewPixels pixels;
    pixels.named = write_names();
    write_title();
    write_legend();
    pixels.width = picture_.cols;
    pixels.height = picture_.rows;
    pixels.bgr.assign(picture_.data, picture_.data + picture_.total() * 3);
    return pixels;
  }

 private:
  void list(LayerRenderer& renderer) {
    list_.clear(projection_.views().size());
    const Transform<CameraOptical, Map> T_optical_map = camera_.T_map_optical.inverse();
    double floor = extent_.min().z();
    Eigen::AlignedBox3d inside;  // of the floors: entities beyond them hide nothing
    for (const ModelEntity& e : model_.entities) {
      if (e.label != EntityLabel::floor || !in_model_view(e)) continue;
      floor = e.T_map_body.translation().z() + e.size.z() / 2;
      const Eigen::Vector3d reach = e.T_map_body.rotation().cwiseAbs() * e.size / 2;
      inside.extend(Eigen::Vector3d(e.T_map_body.translation() - reach));
      inside.extend(Eigen::Vector3d(e.T_map_body.translation() + reach));
    }
    const Eigen::Vector3d middle = inside.isEmpty() ? extent_.center() : inside.center();
    for (std::size_t i = 0; i < model_.entities.size(); ++i) {
      const ModelEntity& e = model_.entities[i];
      const Paint* paint = paint_of(e.label);
      if (!in_model_view(e) || paint == nullptr) continue;
      const bool cut = view_.cut > 0 && stands_before(e, middle, camera_);
      const auto shape = shown_part(e, cut ? floor + view_.cut : std::numeric_limits<double>::infinity());
      if (!shape) continue;
      Material material = material_of(*paint);
      if (e.is_virtual) material.albedo = {linear(163), linear(113), linear(247)};
      const Transform<CameraOptical, ShapeFrame> T_optical_shape =
          T_optical_map * Transform<Map, Body>(e.T_map_body) * shape->T_body_shape;
      list_.shapes[mesh_index(ShapeKind::box, 0, false)].push_back(
          scaled(make_instance(T_optical_shape, {half_extents(*shape).cast<float>(), 0.F}, material,
                               std::min<std::size_t>(i + 1, kMeshEntity - 1))));
      used_[e.label] = true;
    }
    const BuildingMesh mesh = building_mesh(model_);
    if (!mesh.chunks.empty()) {
      renderer.set_mesh(mesh);
      for (std::uint32_t i = 0; i < mesh.chunks.size(); ++i) list_.mesh_shown.push_back(i);
      list_.mesh = scaled(mesh_instance(camera_.T_map_optical, material_of(*paint_of(EntityLabel::unknown))));
      list_.mesh.entity = static_cast<float>(kMeshEntity);
      used_[EntityLabel::unknown] = true;
    }
    list_.farthest = 3;  // drawn units: an upper bound of the extent's far end
    for (std::size_t v = 0; v < projection_.views().size(); ++v)
      list_.view_rects[v] =
          projection_.view_rect(v, {0, 0, camera_.intrinsics.width, camera_.intrinsics.height});
  }

  Instance scaled(Instance instance) const {
    for (float& x : instance.translation) x *= static_cast<float>(camera_.scale);
    for (float& x : instance.scale) x *= static_cast<float>(camera_.scale);
    return instance;
  }

  /// 0 where nothing is drawn.
  std::uint32_t entity_at(int x, int y) const {
    if (x < layer_.rect.x0 || y < layer_.rect.y0 || x >= layer_.rect.x1 || y >= layer_.rect.y1) return 0;
    const std::uint32_t depth_id = layer_.depth_id[layer_.at(x, y)];
    return depth_id == 0 ? 0 : layer_entity(depth_id);
  }

  /// Colours over paper, outlines between entities, then reduced to the picture's size.
  void compose() {
    cv::Mat fine(camera_.intrinsics.height, camera_.intrinsics.width, CV_8UC3, cv::Scalar(250, 247, 244));
    for (int y = layer_.rect.y0; y < layer_.rect.y1; ++y) {
      for (int x = layer_.rect.x0; x < layer_.rect.x1; ++x) {
        const std::uint8_t* rgba = &layer_.rgba[4 * layer_.at(x, y)];
        auto& out = fine.at<cv::Vec3b>(y, x);
        const std::uint32_t here = entity_at(x, y);
        const bool edge = here != entity_at(x + 1, y) || here != entity_at(x, y + 1);
        for (int k = 0; k < 3; ++k) {
          const int over = rgba[2 - k] + out[k] * (255 - rgba[3]) / 255;
          out[k] = static_cast<std::uint8_t>(std::min(255, over) * (edge ? 45 : 100) / 100);
        }
      }
    }
    cv::resize(fine, picture_, {view_.width, view_.height}, 0, 0, cv::INTER_AREA);
  }

  static int importance(EntityLabel label) {
    switch (label) {
      case EntityLabel::door:
        return 0;
      case EntityLabel::stairs:
      case EntityLabel::ramp:
        return 1;
      case EntityLabel::window:
      case EntityLabel::pillar:
        return 2;
      case EntityLabel::wall:
        return 3;
      case EntityLabel::floor:
        return 4;
      default:
        return 9;
    }
  }

  /// The label of an entity: the flight for a step.
  static std::string displayed_name(const ModelEntity& e) {
    const bool in_parts = e.label == EntityLabel::stairs || e.label == EntityLabel::floor;
    return in_parts && !e.part_of.empty() ? e.part_of : e.name;
  }

  std::vector<std::string> write_names() {
    struct Seen {
      double x = 0, y = 0, count = 0;
    };
    std::vector<Seen> seen(model_.entities.size());
    for (int y = layer_.rect.y0; y < layer_.rect.y1; ++y) {
      for (int x = layer_.rect.x0; x < layer_.rect.x1; ++x) {
        const std::uint32_t entity = entity_at(x, y);
        if (entity == 0 || entity > seen.size() || entity == kMeshEntity) continue;
        Seen& s = seen[entity - 1];
        s.x += x, s.y += y, s.count += 1;
      }
    }
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (seen[i].count >= 900) order.push_back(i);
    }
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      const int x = importance(model_.entities[a].label), y = importance(model_.entities[b].label);
      return x != y ? x < y : seen[a].count > seen[b].count;
    });
    std::vector<std::string> named;
    std::vector<cv::Rect> taken;
    for (const std::size_t i : order) {
      const ModelEntity& e = model_.entities[i];
      const std::string word = displayed_name(e);
      if (importance(e.label) > 4 || std::find(named.begin(), named.end(), word) != named.end()) continue;
      const cv::Point at(static_cast<int>(seen[i].x / seen[i].count / kFineness),
                         static_cast<int>(seen[i].y / seen[i].count / kFineness));
      if (write_name(word, at, taken)) named.push_back(word);
    }
    return named;
  }

  bool write_name(const std::string& word, const cv::Point& middle, std::vector<cv::Rect>& taken) {
    constexpr double scale = 0.46;
    int baseline = 0;
    const cv::Size size = cv::getTextSize(word, cv::FONT_HERSHEY_DUPLEX, scale, 1, &baseline);
    const cv::Rect inside(6, kTitle + 4, view_.width - 12, view_.height - kTitle - kLegend - 8);
    for (const int dy : {0, -20, 20, -40, 40}) {
      const cv::Rect box(middle.x - size.width / 2 - 5, middle.y + dy - size.height / 2 - 5, size.width + 10,
                         size.height + 10);
      if ((box & inside) != box) continue;
      if (std::any_of(taken.begin(), taken.end(), [&](const cv::Rect& r) { return (r & box).area() > 0; }))
        continue;
      taken.push_back(box);
      cv::Mat under = picture_(box);
      under.convertTo(under, -1, 0.25, 191);  // a veil, so that labels are readable on any background
      cv::putText(picture_, word, {box.x + 5, box.y + 5 + size.height}, cv::FONT_HERSHEY_DUPLEX, scale,
                  {46, 38, 32}, 1, cv::LINE_AA);
      return true;
    }
    return false;
  }

  void write_title() {
    cv::rectangle(picture_, {0, 0}, {view_.width, kTitle}, {255, 255, 255}, cv::FILLED);
    cv::line(picture_, {0, kTitle}, {view_.width, kTitle}, {222, 215, 208}, 1);
    cv::putText(picture_, view_.title, {24, 36}, cv::FONT_HERSHEY_DUPLEX, 0.95, {46, 38, 32}, 1, cv::LINE_AA);
    cv::putText(picture_, view_.subtitle, {24, 62}, cv::FONT_HERSHEY_DUPLEX, 0.5, {129, 119, 110}, 1,
                cv::LINE_AA);
  }

  void write_legend() {
    const int top = view_.height - kLegend, middle = top + kLegend / 2;
    cv::rectangle(picture_, {0, top}, {view_.width, view_.height}, {255, 255, 255}, cv::FILLED);
    cv::line(picture_, {0, top}, {view_.width, top}, {222, 215, 208}, 1);
    int x = 24;
    for (const Paint& paint : kPaints) {
      if (!used_[paint.label]) continue;
      const cv::Rect box(x, middle - 9, 26, 18);
      cv::rectangle(picture_, box, cv::Scalar(paint.srgb[2], paint.srgb[1], paint.srgb[0]), cv::FILLED);
      cv::rectangle(picture_, box, {110, 110, 110}, 1);
      cv::putText(picture_, paint.words, {x + 36, middle + 6}, cv::FONT_HERSHEY_DUPLEX, 0.55, {46, 38, 32}, 1,
                  cv::LINE_AA);
      int baseline = 0;
      x += 66 + cv::getTextSize(paint.words, cv::FONT_HERSHEY_DUPLEX, 0.55, 1, &baseline).width;
    }
  }

  const SemanticModel& model_;
  const ModelView& view_;
  Eigen::AlignedBox3d extent_;
  ModelViewCamera camera_;
  CameraProjection projection_;
  DrawList list_;
  Layer layer_;
  cv::Mat picture_;
  std::map<EntityLabel, bool> used_;
};

}  // namespace

Result<ModelViewPixels> draw_model_view(const SemanticModel& model, const ModelView& view) {
  if (view.width < 400 || view.height < 300 || view.width > 4000 || view.height > 4000)
    return Error{"3D view: expected 400 to 4000 by 300 to 4000 pixels"};
  Eigen::AlignedBox3d extent;
  for (const Eigen::Vector3d& p : points_in_view(model)) extent.extend(p);
  if (extent.isEmpty()) return Error{"3D view: the model has nothing to draw"};
  if (!extent.min().allFinite() || !extent.max().allFinite())
    return Error{"3D view: the model's coordinates are not finite"};
  return Viewer(model, view, extent).draw();
}

}  // namespace parhelion::render
