#include "fusion/semantic/pictures/model_plan.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <optional>

#include "fusion/semantic/build_model.hpp"
#include "fusion/semantic/pictures/plan_canvas.hpp"
#include "fusion/semantic/pictures/plan_labels.hpp"
#include "fusion/semantic/pictures/plan_legend.hpp"
#include "fusion/semantic/pictures/plan_outline.hpp"
#include "fusion/semantic/pictures/plan_palette.hpp"
#include "fusion/semantic/pictures/plan_remarks.hpp"
#include "fusion/semantic/pictures/plan_view.hpp"
#include "protocols/length_text.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kShortestWall = 0.6;  ///< m; shorter walls get no length label

const Colour kHatchColour{196, 203, 211};
const Colour kGridColour{236, 239, 242};
const Colour kAxisX{207, 34, 46}, kAxisY{26, 127, 55};

/// In drawing order.
struct Layer {
  EntityLabel label;
  const char* legend;
  Colour colour;
};
constexpr Layer kLayers[] = {
    {EntityLabel::free_space, "free space of a door", {203, 236, 208}},
    {EntityLabel::ramp, "ramp", {186, 199, 222}},
    {EntityLabel::stairs, "stairs", {130, 154, 196}},
    {EntityLabel::unknown, "unknown (solid)", {201, 178, 150}},
    {EntityLabel::wall, "wall", {72, 84, 104}},
    {EntityLabel::window, "window", {84, 174, 255}},
    {EntityLabel::door, "door", {214, 137, 16}},
    {EntityLabel::pillar, "pillar", {120, 80, 130}},
};
const Colour kVirtualColour{163, 113, 247};

/// Of a label that has a layer.
constexpr Colour colour_of(EntityLabel label) {
  return std::find_if(std::begin(kLayers), std::end(kLayers),
                      [&](const Layer& l) { return l.label == label; })
      ->colour;
}

class PlanRenderer {
 public:
  PlanRenderer(const MainPart& shown, const ModelPlan& plan, const Eigen::AlignedBox2d& view)
      : model_(shown.model),
        plan_(plan),
        view_(view),
        left_out_(shown.left_out),
        canvas_(plan.width, view, palette::kTitleBar, PlanLegend::kHeight),
        labels_(canvas_) {}

  const PlanCanvas& paint() {
    paint_unobserved();
    paint_floors();
    paint_meshes();
    for (const Layer& layer : kLayers) paint_layer(layer);
    paint_virtual();
    for (const ModelEntity& entity : model_.entities) {
      if (in_plan(entity) && entity.hinge) paint_swing(entity);
    }
    paint_doubts(model_, plan_.remarks, canvas_, legend_);
    write_dimensions();
    paint_objects(plan_.remarks, canvas_, labels_, legend_);
    paint_coordinates(view_, canvas_);
    paint_title();
    paint_axes();
    legend_.paint(canvas_);
    return canvas_;
  }

 private:
  using Points = std::vector<Eigen::Vector2d>;

  /// Everything outside of the measured floors.
  void paint_unobserved() {
    Eigen::AlignedBox2d whole = view_;
    const Eigen::Vector2d half = whole.sizes();
    whole.extend(Eigen::Vector2d(view_.center() + half)).extend(Eigen::Vector2d(view_.center() - half));
    const Outline corners{
        whole.min(), {whole.max().x(), whole.min().y()}, whole.max(), {whole.min().x(), whole.max().y()}};
    canvas_.fill({corners}, {247, 248, 250}, 1);
    hatch(canvas_, corners, kHatchColour, 13);
    legend_.add({"not observed", kHatchColour, LegendEntry::Mark::area});
  }

  void paint_floors() {
    std::vector<Outline> floors;
    for (const ModelEntity& entity : model_.entities) {
      if (in_plan(entity) && entity.label == EntityLabel::floor) floors.push_back(outline_of(entity));
    }
    if (floors.empty()) return;
    // Only its outer half remains: borders between pieces of a floor are not drawn.
    for (const Outline& floor : floors)
      canvas_.line(Points(floor.begin(), floor.end()), palette::kRule, 2, true);
    canvas_.fill(floors, palette::kPaper, 1);
    for (const Outline& floor : floors) {
      Eigen::AlignedBox2d box;
      for (const Eigen::Vector2d& p : floor) box.extend(p);
      if (box.sizes().maxCoeff() > 200) continue;
      const Points edge(floor.begin(), floor.end());
      for (int axis = 0; axis < 2; ++axis) {
        for (double at = std::ceil(box.min()[axis]); at <= box.max()[axis]; at += 1) {
          if (const auto piece = chord(edge, axis, at))
            canvas_.line({piece->first, piece->second}, kGridColour, 1);
        }
      }
    }
    legend_.add({"floor (grid 1 m)", palette::kRule, LegendEntry::Mark::line});
  }

  void paint_meshes() {
    constexpr float head = 1.9F;  // m
    const auto top = static_cast<float>(ground_floor(model_).value_or(1e6)) + head;
    std::vector<Outline> triangles;
    for (const ModelMesh& mesh : model_.meshes) {
      for (const auto& triangle : mesh.triangles) {
        if (std::all_of(triangle.begin(), triangle.end(), [&](auto i) { return mesh.vertices[i].z() > top; }))
          continue;
        Outline outline;
        for (const std::uint32_t i : triangle)
          outline.emplace_back(mesh.vertices[i].x(), mesh.vertices[i].y());
        triangles.push_back(std::move(outline));
      }
    }
    if (triangles.empty()) return;
    canvas_.fill(triangles, colour_of(EntityLabel::unknown), 0.8);
  }

  void paint_layer(const Layer& layer) {
    std::vector<Outline> outlines, faint_ones;
    for (const ModelEntity& entity : model_.entities) {
      if (!in_plan(entity) || entity.is_virtual || entity.label != layer.label) continue;
      outlines.push_back(outline_of(entity));
      if (entity.label == EntityLabel::wall && entity.observed < 0.3) faint_ones.push_back(outlines.back());
    }
    const bool mesh = layer.label == EntityLabel::unknown && !model_.meshes.empty();
    if (outlines.empty() && !mesh) return;
    const double opacity = layer.label == EntityLabel::free_space ? 0.7 : 1;
    canvas_.fill(outlines, layer.colour, opacity);
    if (!faint_ones.empty()) canvas_.fill(faint_ones, palette::kPaper, 0.55);
    const Colour edge{static_cast<std::uint8_t>(layer.colour.red * 2 / 3),
                      static_cast<std::uint8_t>(layer.colour.green * 2 / 3),
                      static_cast<std::uint8_t>(layer.colour.blue * 2 / 3)};
    for (const Outline& outline : outlines) canvas_.line(outline, edge, 1, true);
    legend_.add({layer.legend, layer.colour, LegendEntry::Mark::area});
  }

  void paint_virtual() {
    std::vector<Outline> outlines;
    for (const ModelEntity& entity : model_.entities) {
      if (in_plan(entity) && entity.is_virtual) outlines.push_back(outline_of(entity));
    }
    if (outlines.empty()) return;
    canvas_.fill(outlines, kVirtualColour, 0.8);
    for (const Outline& outline : outlines) canvas_.line(outline, kVirtualColour, 1.5, true);
    legend_.add({"virtual wall", kVirtualColour, LegendEntry::Mark::area});
  }

  /// The arc of a door's free edge between the limits of its hinge.
  void paint_swing(const ModelEntity& door) {
    const Hinge& hinge = *door.hinge;
    const double side = hinge.axis.x() < 0 ? 1 : -1;
    const double span = std::min(hinge.upper - hinge.lower, std::numbers::pi);
    const double leaf = door.size.x() / 2 + std::abs(hinge.axis.x());
    Points arc;
    for (int i = 0; i <= 24; ++i) {
      const double angle = hinge.lower + span * i / 24;
      const Eigen::Vector2d tip = hinge.axis + Eigen::Rotation2Dd(angle) * Eigen::Vector2d(side * leaf, 0);
      arc.push_back((door.T_map_body * Eigen::Vector3d(tip.x(), tip.y(), 0)).head<2>());
    }
    canvas_.line(arc, colour_of(EntityLabel::door), 1.2);
    const Eigen::Vector2d axis =
        (door.T_map_body * Eigen::Vector3d(hinge.axis.x(), hinge.axis.y(), 0)).head<2>();
    canvas_.line({axis, arc.back()}, colour_of(EntityLabel::door), 1.2);
  }

  void write_dimensions() {
    for (const ModelEntity& entity : model_.entities) {
      if (in_plan(entity) && entity.label != EntityLabel::floor && entity.label != EntityLabel::free_space)
        labels_.keep_clear(outline_of(entity));
    }
    // Doors first: they are few and most important.
    for (const ModelEntity& entity : model_.entities) {
      if (!in_plan(entity) || entity.label != EntityLabel::door) continue;
      labels_.beside(entity, entity.name + "  " + length_text(entity.size.x()), 13, {150, 90, 0});
    }
    write_stairs();
    std::vector<const ModelEntity*> walls;
    for (const ModelEntity& entity : model_.entities) {
      if (in_plan(entity) && entity.label == EntityLabel::wall && entity.size.x() >= kShortestWall)
        walls.push_back(&entity);
    }
    std::stable_sort(walls.begin(), walls.end(),
                     [](const auto* a, const auto* b) { return a->size.x() > b->size.x(); });
    for (const ModelEntity* wall : walls) {
      if (walls.size() > 60 && wall->size.x() * canvas_.pixels_per_metre() < 60) break;
      const std::string length = length_text(wall->size.x());
      const Colour colour = wall->is_virtual ? kVirtualColour : palette::kInk;
      if (!labels_.beside(*wall, wall->name + "  " + length, 12, colour))
        labels_.beside(*wall, length, 12, colour);
    }
    for (const ModelEntity& entity : model_.entities) {
      if (in_plan(entity) && (entity.label == EntityLabel::pillar || entity.label == EntityLabel::window))
        labels_.beside(entity, entity.name, 11, palette::kFaint);
    }
  }

  /// A flight's name, its steps and an arrow that points up.
  void write_stairs() {
    std::map<std::string, std::vector<const ModelEntity*>> flights;
    for (const ModelEntity& entity : model_.entities) {
      if (in_plan(entity) && entity.label == EntityLabel::stairs)
        flights[entity.part_of.empty() ? entity.name : entity.part_of].push_back(&entity);
    }
    for (auto& [name, steps] : flights) {
      const auto top = [](const ModelEntity* e) { return e->T_map_body.translation().z() + e->size.z() / 2; };
      std::stable_sort(steps.begin(), steps.end(),
                       [&](const auto* a, const auto* b) { return top(a) < top(b); });
      const Eigen::Vector2d from = steps.front()->T_map_body.translation().head<2>(),
                            to = steps.back()->T_map_body.translation().head<2>();
      if ((to - from).norm() > 0.1) {
        const Eigen::Vector2d along = (to - from).normalized() * (9 / canvas_.pixels_per_metre());
        const Eigen::Vector2d across(-along.y(), along.x());
        canvas_.line({from, to}, palette::kPaper, 2.2);
        canvas_.fill({{to + along, to - along + across * 0.8, to - along - across * 0.8}}, palette::kPaper,
                     1);
      }
      std::string words =
          name + "  " + std::to_string(steps.size()) + (steps.size() == 1 ? " step" : " steps");
      if (steps.size() > 1) {
        const double rise = (top(steps.back()) - top(steps.front())) / static_cast<double>(steps.size() - 1);
        words += ", rise " + length_text(rise);
      }
      labels_.beside(*steps.front(), words, 13, {44, 62, 110});
    }
  }

  /// In the title bar, where they hide nothing.
  void paint_axes() {
    const Eigen::Vector2d from(canvas_.width() - 76, palette::kTitleBar - 14);
    const auto arrow = [&](const Eigen::Vector2d& along, Colour colour, const char* name) {
      const Eigen::Vector2d to = from + 34 * along, across(-along.y(), along.x());
      canvas_.pixel_line(from, to, colour, 2.5);
      for (const double side : {-1.0, 1.0})
        canvas_.pixel_line(to, to - 8 * along + side * 5 * across, colour, 2.5);
      const Eigen::Vector2d at = to + 10 * along;
      canvas_.text({at.x() - 4, at.y() + 5}, name, 12, colour);
    };
    arrow({1, 0}, kAxisX, "x");
    arrow({0, -1}, kAxisY, "y");
    canvas_.text({from.x() - canvas_.text_width("map", 11) - 10, from.y() + 4}, "map", 11, palette::kFaint);
  }

  void paint_title() {
    canvas_.bar({Eigen::Vector2d(0, 0), Eigen::Vector2d(canvas_.width(), palette::kTitleBar)},
                palette::kPaper);
    canvas_.pixel_line({0, palette::kTitleBar}, {double(canvas_.width()), palette::kTitleBar}, palette::kRule,
                       1);
    canvas_.text({24, 36}, plan_.title, 20, palette::kInk);
    canvas_.text({24, 62}, plan_.subtitle + (left_out_.empty() ? "" : "; " + left_out_), 12, palette::kFaint);
  }

  const SemanticModel& model_;
  const ModelPlan& plan_;
  Eigen::AlignedBox2d view_;
  std::string left_out_;
  PlanCanvas canvas_;
  PlanLabels labels_;
  PlanLegend legend_;
};

/// Draws the plan and calls use(canvas).
Status paint(const SemanticModel& model, const ModelPlan& plan,
             const std::function<Status(const PlanCanvas&)>& use) {
  if (plan.width < 400 || plan.width > 10'000)
    return Error{"plan: expected 400 <= width <= 10000 pixels, found " + std::to_string(plan.width)};
  const MainPart shown = main_part(model);
  const Eigen::AlignedBox2d view = plan_box(shown.model);
  if (view.isEmpty()) return Error{"plan: the model has nothing to draw"};
  if (!view.min().allFinite() || !view.max().allFinite())
    return Error{"plan: the model's coordinates are not finite"};
  return use(PlanRenderer(shown, plan, view).paint());
}

}  // namespace

Result<ModelPlanPixels> draw_model_plan(const SemanticModel& model, const ModelPlan& plan) {
  ModelPlanPixels pixels;
  const Status painted = paint(model, plan, [&](const PlanCanvas& canvas) -> Status {
    const cv::Mat picture = canvas.picture();
    pixels.width = picture.cols, pixels.height = picture.rows;
    pixels.bgr.assign(picture.data, picture.data + picture.total() * picture.elemSize());
    return {};
  });
  if (!painted) return painted.error();
  return pixels;
}

Status draw_model_plan(const SemanticModel& model, const ModelPlan& plan, const std::string& path) {
  return paint(model, plan, [&](const PlanCanvas& canvas) {
    return canvas.write(path) ? Status() : Status(Error{path + ": the picture cannot be written"});
  });
}

}  // namespace parhelion::semantic
