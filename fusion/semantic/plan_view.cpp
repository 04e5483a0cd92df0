#include "fusion/semantic/plan_view.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include "fusion/semantic/plan_outline.hpp"

namespace parhelion {
namespace {

constexpr double kApart = 4;      ///< m between the main building and a piece that is not of it
constexpr double kSmaller = 0.6;  ///< what is left out, is so where the rest would shrink below this share

using Box = Eigen::AlignedBox2d;

/// Boxes that are near each other, as one; the one with the largest sum of areas.
Box main_building(const std::vector<Box>& boxes) {
  std::vector<std::size_t> part(boxes.size());
  std::iota(part.begin(), part.end(), std::size_t{0});
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      for (std::size_t j = 0; j < boxes.size(); ++j) {
        if (part[j] <= part[i] || boxes[i].exteriorDistance(boxes[j]) > kApart) continue;
        part[j] = part[i];
        changed = true;
      }
    }
  }
  std::vector<double> area(boxes.size(), 0);
  std::vector<Box> whole(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    area[part[i]] += boxes[i].volume() + 0.1 * boxes[i].sizes().sum();
    whole[part[i]].extend(boxes[i]);
  }
  return whole[static_cast<std::size_t>(std::max_element(area.begin(), area.end()) - area.begin())];
}

}  // namespace

bool in_plan(const ModelEntity& e) {
  return !e.deleted && e.T_map_body.finite() && e.size.allFinite() && e.label != EntityLabel::ceiling &&
         e.label != EntityLabel::wall_above_door;
}

PlanView plan_view(const SemanticModel& model) {
  std::vector<Box> boxes;
  Box all;
  for (const ModelEntity& entity : model.entities) {
    if (!in_plan(entity)) continue;
    Box box;
    for (const Eigen::Vector2d& p : outline_of(entity)) box.extend(p);
    boxes.push_back(box);
    all.extend(box);
  }
  for (const ModelMesh& mesh : model.meshes) {
    for (const Eigen::Vector3f& v : mesh.vertices) all.extend(Eigen::Vector2d(v.x(), v.y()));
  }
  PlanView view{all, ""};
  if (all.isEmpty()) return view;
  if (boxes.size() > 1 && boxes.size() < 4000) {
    Box main = main_building(boxes);
    const Box near(main.min().array() - kApart / 2, main.max().array() + kApart / 2);
    for (const ModelMesh& mesh : model.meshes) {
      for (const Eigen::Vector3f& v : mesh.vertices) {
        const Eigen::Vector2d p(v.x(), v.y());
        if (near.contains(p)) main.extend(p);
      }
    }
    const auto beyond =
        std::count_if(boxes.begin(), boxes.end(), [&](const Box& box) { return !main.intersects(box); });
    if (main.sizes().maxCoeff() < kSmaller * all.sizes().maxCoeff()) {
      view.box = main;
      view.left_out = "cropped to the main building: " + std::to_string(beyond) +
                      (beyond == 1 ? " piece" : " pieces") + " further off left out";
    }
  }
  const double margin = std::max(0.8, 0.07 * view.box.sizes().maxCoeff());
  view.box = Box(view.box.min().array() - margin, view.box.max().array() + margin);
  return view;
}

}  // namespace parhelion
