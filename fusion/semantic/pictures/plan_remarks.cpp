#include "fusion/semantic/pictures/plan_remarks.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace parhelion::semantic {
namespace {

const Colour kObjectColour{146, 110, 66}, kDoubtColour{207, 34, 46}, kCoordinate{110, 119, 129};

ModelEntity box_of(const ModelObject& object) {
  ModelEntity box;
  box.name = object.name;
  box.T_map_body = object.T_map_body;
  box.size = object.size;
  return box;
}

std::string label_of(const ModelObject& object) {
  return object.name +
         (object.posture == Posture::unknown ? "" : std::string(", ") + to_string(object.posture));
}

/// The doubtful part, wide enough to be seen.
ModelEntity doubtful_box(const SemanticModel& model, const ModelRemarks& remarks, const ModelDoubt& doubt) {
  constexpr double kMin = 0.3;  // m
  const auto is_meant = [&](const auto& part) { return part.name == doubt.entity; };
  const auto entity = std::find_if(model.entities.begin(), model.entities.end(), is_meant);
  const auto object = std::find_if(remarks.objects.begin(), remarks.objects.end(), is_meant);
  ModelEntity box;
  box.T_map_body = Transform<Map, Body>::planar(doubt.place.x(), doubt.place.y(), 0, doubt.place.z());
  box.size = Eigen::Vector3d::Constant(doubt.extent);
  if (object != remarks.objects.end()) box = box_of(*object);
  if (entity != model.entities.end()) box = *entity;
  box.size = box.size.cwiseMax(kMin);
  return box;
}

/// Most pictures show rooms of some metres: a step with at most twelve numbers.
double step_of(double extent) {
  for (const double step : {0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0}) {
    if (extent / step <= 12) return step;
  }
  return 100;
}

std::string number(double v) {
  const bool whole = std::abs(v - std::round(v)) < 1e-6;
  std::string words = std::to_string(whole ? std::lround(v) : std::lround(10 * v));
  if (!whole) words.insert(words.size() - 1, words.size() > 1 && words[words.size() - 2] != '-' ? "." : "0.");
  return words;
}

}  // namespace

void hatch(PlanCanvas& canvas, const Outline& convex, Colour colour, double spacing) {
  const Eigen::Rotation2Dd turn(EIGEN_PI / 4);
  Outline turned;
  Eigen::AlignedBox2d extent;
  for (const Eigen::Vector2d& corner : convex) extent.extend(turned.emplace_back(turn * corner));
  const double step = spacing / canvas.pixels_per_metre();
  for (double at = std::ceil(extent.min().y() / step) * step; at < extent.max().y(); at += step) {
    if (const auto line = chord(turned, 1, at))
      canvas.line({turn.inverse() * line->first, turn.inverse() * line->second}, colour, 1);
  }
}

void paint_objects(const ModelRemarks& remarks, PlanCanvas& canvas, PlanLabels& labels, PlanLegend& legend) {
  if (remarks.objects.empty()) return;
  constexpr double max_below = 3;
  std::vector<const ModelObject*> named;
  for (const ModelObject& object : remarks.objects) {
    const Outline outline = outline_of(box_of(object));
    canvas.line(outline, kObjectColour, 1.2, true);
    labels.keep_clear(outline);
    const double pixels = object.size.x() * canvas.pixels_per_metre();
    if (object.kind != ObjectKind::object || pixels > 40) named.push_back(&object);
  }
  const auto area = [](const ModelObject* o) { return o->size.x() * o->size.y(); };
  std::stable_sort(named.begin(), named.end(),
                   [&](const auto* a, const auto* b) { return area(a) > area(b); });
  std::size_t written = 0;
  for (const ModelObject* object : named)
    written += labels.beside(box_of(*object), label_of(*object), 10, kObjectColour, max_below);
  const std::size_t without = remarks.objects.size() - written;
  legend.add({without == 0 ? "object" : "object (" + std::to_string(without) + " not named)", kObjectColour,
              LegendEntry::Mark::line});
}

void paint_doubts(const SemanticModel& model, const ModelRemarks& remarks, PlanCanvas& canvas,
                  PlanLegend& legend) {
  for (const ModelDoubt& doubt : remarks.doubts) {
    const Outline outline = outline_of(doubtful_box(model, remarks, doubt));
    hatch(canvas, outline, kDoubtColour, 7);
    canvas.line(outline, kDoubtColour, 1, true);
  }
  if (!remarks.doubts.empty()) legend.add({"doubtful", kDoubtColour, LegendEntry::Mark::area});
}

void paint_coordinates(const Eigen::AlignedBox2d& view, PlanCanvas& canvas) {
  const double step = step_of(view.sizes().maxCoeff());
  for (double x = std::ceil(view.min().x() / step) * step; x < view.max().x(); x += step) {
    const double at = canvas.pixel({x, view.min().y()}).x(), bottom = canvas.plan_bottom();
    canvas.pixel_line({at, bottom - 8}, {at, bottom}, kCoordinate, 1.2);
    canvas.text({at + 3, bottom - 4.0}, number(x), 10, kCoordinate, true);
  }
  for (double y = std::ceil(view.min().y() / step) * step; y < view.max().y(); y += step) {
    const double at = canvas.pixel({view.min().x(), y}).y();
    canvas.pixel_line({0, at}, {8, at}, kCoordinate, 1.2);
    canvas.text({3, at - 3}, number(y), 10, kCoordinate, true);
  }
}

}  // namespace parhelion::semantic
