#include "fusion/semantic/pictures/plan_view.hpp"

#include <algorithm>
#include <vector>

#include "fusion/semantic/pictures/plan_outline.hpp"

namespace parhelion::semantic {
namespace {

using Box = Eigen::AlignedBox2d;

constexpr double kReach = 3;  ///< m

Box box_of(const ModelEntity& entity) {
  Box box;
  for (const Eigen::Vector2d& p : outline_of(entity)) box.extend(p);
  return box;
}

std::vector<Eigen::Vector2d> mesh_points(const SemanticModel& model) {
  std::vector<Eigen::Vector2d> points;
  for (const ModelMesh& mesh : model.meshes) {
    for (const Eigen::Vector3f& v : mesh.vertices) points.emplace_back(v.x(), v.y());
  }
  return points;
}

/// Grows from the floors; without floors, from the largest entity.
Box main_box(const std::vector<Box>& floors, const std::vector<Box>& things) {
  Box part;
  for (const Box& floor : floors) part.extend(floor);
  if (part.isEmpty() && !things.empty()) {
    const auto reach = [](const Box& box) { return box.sizes().sum(); };
    part = *std::max_element(things.begin(), things.end(),
                             [&](const Box& a, const Box& b) { return reach(a) < reach(b); });
  }
  for (bool grown = true; grown;) {
    grown = false;
    for (const Box& box : things) {
      if (part.contains(box) || part.exteriorDistance(box) > kReach) continue;
      part.extend(box);
      grown = true;
    }
  }
  return part;
}

/// Drops vertices that no triangle uses any more: they would enlarge the picture.
void keep_inside(const Box& part, ModelMesh& mesh) {
  std::erase_if(mesh.triangles, [&](const auto& triangle) {
    return std::any_of(triangle.begin(), triangle.end(), [&](std::uint32_t i) {
      return !part.contains(mesh.vertices[i].head<2>().cast<double>().eval());
    });
  });
  std::vector<std::int64_t> place(mesh.vertices.size(), -1);
  std::vector<Eigen::Vector3f> kept;
  for (auto& triangle : mesh.triangles) {
    for (std::uint32_t& i : triangle) {
      if (place[i] < 0) {
        place[i] = static_cast<std::int64_t>(kept.size());
        kept.push_back(mesh.vertices[i]);
      }
      i = static_cast<std::uint32_t>(place[i]);
    }
  }
  mesh.vertices = std::move(kept);
}

}  // namespace

MainPart main_part(const SemanticModel& model) {
  std::vector<Box> floors, things;
  Box all;
  for (const ModelEntity& entity : model.entities) {
    if (!in_plan(entity)) continue;
    (is_ground(entity.label) ? floors : things).push_back(box_of(entity));
    all.extend(box_of(entity));
  }
  Box part = main_box(floors, things);
  MainPart shown{model, ""};
  if (part.isEmpty()) return shown;
  const Box near(part.min().array() - kReach, part.max().array() + kReach);
  for (const Eigen::Vector2d& p : mesh_points(model)) {
    all.extend(p);
    if (near.contains(p)) part.extend(p);
  }
  if (part.contains(all) || all.volume() < 2 * part.volume()) return shown;
  const auto beyond = std::erase_if(shown.model.entities, [&](const ModelEntity& entity) {
    return in_plan(entity) && !part.contains(box_of(entity));
  });
  std::erase_if(shown.model.entities, [&](const ModelEntity& entity) {
    return entity.label == EntityLabel::wall_above_door && !part.contains(box_of(entity));
  });
  for (ModelMesh& mesh : shown.model.meshes) keep_inside(part, mesh);
  shown.left_out =
      beyond == 0 ? "distant parts are not shown"
                  : std::to_string(beyond) + (beyond == 1 ? " part" : " parts") + " farther out not shown";
  return shown;
}

bool in_plan(const ModelEntity& e) {
  return !e.deleted && e.T_map_body.finite() && e.size.allFinite() && e.label != EntityLabel::ceiling &&
         e.label != EntityLabel::wall_above_door;
}

Eigen::AlignedBox2d plan_box(const SemanticModel& model) {
  Box all;
  for (const ModelEntity& entity : model.entities) {
    if (in_plan(entity)) all.extend(box_of(entity));
  }
  for (const Eigen::Vector2d& p : mesh_points(model)) all.extend(p);
  if (all.isEmpty()) return all;
  const double margin = std::max(0.8, 0.07 * all.sizes().maxCoeff());
  return {all.min().array() - margin, all.max().array() + margin};
}

}  // namespace parhelion::semantic
