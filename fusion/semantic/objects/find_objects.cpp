#include "fusion/semantic/objects/find_objects.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "fusion/semantic/objects/classify_object.hpp"
#include "fusion/semantic/objects/object_groups.hpp"
#include "fusion/semantic/objects/open_ground.hpp"
#include "fusion/semantic/occupied_cubes.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kFinest = 0.05, kCoarsest = 0.15;  ///< m, of the cubes
constexpr std::size_t kFewest = 10;                 ///< cubes of an object
constexpr std::size_t kFewestPoints = 25;
constexpr double kSmallest = 0.12;                            ///< m, of its longest side
constexpr double kPlate = 0.04;                               ///< m^2
constexpr double kThin = 0.15, kAsWall = 2.2, kAsHigh = 1.8;  ///< m: a sheet that is more likely a wall
constexpr double kOn = 0.12;                                  ///< m, from a top to what stands on it
constexpr double kNextTo = 0.25;                              ///< m

/// m: about the distance between points where they are few.
double cell_of(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels) {
  std::size_t points = 0;
  OccupiedCubes cubes;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] != static_cast<std::uint8_t>(EntityLabel::unknown)) continue;
    ++points;
    const Eigen::Array3d at = (cloud.points[i].cast<double>() / kFinest).array().floor();
    if (at.abs().maxCoeff() < ObjectGrid::kFar) cubes.add(at.cast<int>());
  }
  if (points == 0) return kFinest;
  // Cubes of the finest size that hold one point only tell a sparse cloud.
  const double each =
      static_cast<double>(points) / static_cast<double>(std::max<std::size_t>(1, cubes.count()));
  return each > 2.5 ? kFinest : each > 1.5 ? 0.06 : each > 1.15 ? 0.08 : 0.10;
}

bool is_sheet(const ObjectShape& s) { return s.width < kThin && s.length > kAsWall && s.top > kAsHigh; }

/// A sheet in the plane of a wall, or beyond its end, that is higher than furniture: a piece of it that was
/// measured too sparsely to be found with it.
bool is_in_wall(const ObjectShape& s, const ModelEntity& wall) {
  constexpr double kSheet = 0.2, kOff = 0.15, kBeyond = 1.5, kParallel = 0.98;  // m, cosine
  if (s.width > kSheet || s.top < kAsHigh) return false;
  const Eigen::Vector3d p = wall.T_map_body.inverse() * Eigen::Vector3d(s.middle.x(), s.middle.y(), 0);
  const Eigen::Vector2d along = (wall.T_map_body.rotation() * Eigen::Vector3d::UnitX()).head<2>();
  return std::abs(p.y()) < wall.size.y() / 2 + kOff && std::abs(p.x()) < wall.size.x() / 2 + kBeyond &&
         std::abs(along.dot(Eigen::Vector2d(std::cos(s.yaw), std::sin(s.yaw)))) > kParallel;
}

/// m in the plan from the shape's middle to an entity's box.
double plan_distance(const ObjectShape& s, const ModelEntity& e) {
  const Eigen::Vector3d p = e.T_map_body.inverse() * Eigen::Vector3d(s.middle.x(), s.middle.y(), 0);
  return (p.head<2>().cwiseAbs() - 0.5 * e.size.head<2>()).cwiseMax(0).norm();
}

/// An upright bar at a wall: its end, or the jamb of an opening.
bool is_edge_of(const ObjectShape& s, const ModelEntity& wall) {
  constexpr double kBroad = 0.35, kThick = 0.15, kHigh = 1, kAt = 0.15;  // m
  return s.length < kBroad && s.width < kThick && s.top - s.bottom > kHigh && plan_distance(s, wall) < kAt;
}

/// A sheet that ends at the height of a floor over it: the face under the floor's rim.
bool is_face_under(const ObjectShape& s, const ModelEntity& floor) {
  constexpr double kSheet = 0.2, kHigh = 1, kLevel = 0.15, kRim = 0.4;  // m
  const double top = floor.T_map_body.translation().z() + floor.size.z() / 2;
  return s.width < kSheet && s.top - s.bottom > kHigh && std::abs(s.floor + s.top - top) < kLevel &&
         plan_distance(s, floor) < kRim;
}

/// Whether most of a group lies beside or under a flight's steps: their sides and undersides.
bool is_of_stairs(const ObjectGrid& grid, const ObjectGroup& group,
                  const std::vector<const ModelEntity*>& steps) {
  constexpr double kBeside = 0.2, kOver = 0.08, kMaxFraction = 0.7;  // m, m, fraction
  if (steps.empty()) return false;
  std::vector<Transform<Body, Map>> T_step_map;
  for (const ModelEntity* step : steps) T_step_map.push_back(step->T_map_body.inverse());
  const auto in_step = [&](std::size_t s, const Eigen::Vector3d& p) {
    const Eigen::Vector3d local = T_step_map[s] * p;
    const ModelEntity& step = *steps[s];
    return (local.head<2>().cwiseAbs().array() < 0.5 * step.size.head<2>().array() + kBeside).all() &&
           local.z() < 0.5 * step.size.z() + kOver && local.z() > -0.5 * step.size.z() - kOver;
  };
  std::size_t inside = 0;
  for (const std::uint32_t c : group.cubes) {
    const Eigen::Vector3d p(grid.plan(c).x(), grid.plan(c).y(), static_cast<double>(grid.cubes()[c].z));
    std::size_t s = 0;
    while (s < steps.size() && !in_step(s, p)) ++s;
    inside += s < steps.size() ? 1 : 0;
  }
  return static_cast<double>(inside) > kMaxFraction * static_cast<double>(group.cubes.size());
}

/// Low and level: the floor where it is uneven, or a piece of one beyond its box.
bool is_of_floor(const ObjectShape& s) {
  constexpr double kFlat = 0.12;  // m
  return s.top < kFlat && s.length > 3 * kFlat;
}

bool is_movable(const ModelObject& object) {
  switch (object.kind) {
    case ObjectKind::chair:
    case ObjectKind::bin:
    case ObjectKind::box:
    case ObjectKind::plant:
      return true;
    case ObjectKind::table:
      return object.size.head<2>().prod() < 1.2;
    case ObjectKind::object:
      return object.size.prod() < 0.3 && object.size.z() < 1.5;
    default:
      return false;
  }
}

ModelObject object_of(const ObjectShape& shape, const ObjectClass& found) {
  ModelObject object;
  object.kind = found.kind;
  object.confidence = found.confidence;
  object.posture = found.posture;
  const double high = std::max(0.05, shape.top - shape.bottom);
  object.T_map_body = Transform<Map, Body>::planar(shape.middle.x(), shape.middle.y(), shape.yaw,
                                                   shape.floor + 0.5 * (shape.top + shape.bottom));
  const auto tidy = [](double v) { return std::round(v * 1000) / 1000; };
  object.size = {tidy(shape.length), tidy(shape.width), tidy(high)};
  object.movable = is_movable(object);
  return object;
}

/// An object that has no name yet, and what it was told by.
struct Thing {
  ModelObject object;
  ObjectFeatures features;
};

double top(const ModelObject& o) { return o.T_map_body.translation().z() + o.size.z() / 2; }
double bottom(const ModelObject& o) { return o.T_map_body.translation().z() - o.size.z() / 2; }

bool over(const ModelObject& upper, const ModelObject& lower) {
  const Eigen::Vector3d p = lower.T_map_body.inverse() * upper.T_map_body.translation();
  return (p.head<2>().cwiseAbs().array() < 0.5 * lower.size.head<2>().array()).all();
}

/// m in the plan between two boxes, by the one's centre and corners: enough to say that they are neighbours.
double apart(const ModelObject& a, const ModelObject& b) {
  double nearest = 1e9;
  for (const auto& [one, other] : {std::pair{&a, &b}, {&b, &a}}) {
    for (int k = 0; k < 9; ++k) {
      const Eigen::Vector3d corner(0.5 * (k % 3 - 1) * one->size.x(), 0.5 * (k / 3 - 1) * one->size.y(), 0);
      const Eigen::Vector3d p = other->T_map_body.inverse() * (one->T_map_body * corner);
      nearest = std::min(nearest, (p.head<2>().cwiseAbs() - 0.5 * other->size.head<2>()).cwiseMax(0).norm());
    }
  }
  return nearest;
}

void relate(std::vector<ModelObject>& objects) {
  for (ModelObject& a : objects) {
    for (const ModelObject& b : objects) {
      if (&a == &b) continue;
      if ((a.T_map_body.translation() - b.T_map_body.translation()).head<2>().norm() >
          a.size.head<2>().norm() + b.size.head<2>().norm())
        continue;
      if (over(a, b) && std::abs(bottom(a) - top(b)) < kOn) a.on = b.name;
      const bool table = b.kind == ObjectKind::table && bottom(a) < top(b) - 0.2;
      if (table && apart(a, b) < 1e-9) a.under = b.name;
      const bool level = bottom(a) < top(b) && bottom(b) < top(a);
      if (level && apart(a, b) < kNextTo) a.beside.push_back(b.name);
    }
  }
}

}  // namespace

FoundObjects find_objects(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels,
                          const std::vector<ModelEntity>& entities, const ObjectOptions& options) {
  FoundObjects found;
  found.object_of.assign(cloud.size(), kNoObject);
  const double cell =
      options.cell > 0 ? std::clamp(options.cell, kFinest, kCoarsest) : cell_of(cloud, labels);
  const ObjectGrid grid(cloud, labels, entities, cell);
  const std::vector<ObjectPlate> plates = find_plates(grid, kPlate);
  std::vector<const ModelEntity*> steps;
  for (const ModelEntity& entity : entities) {
    if (entity.label == EntityLabel::stairs) steps.push_back(&entity);
  }
  const OpenGround open(entities);
  const std::vector<ObjectGroup> groups = find_groups(grid, plates);
  std::vector<std::optional<Thing>> things(groups.size());
  tbb::parallel_for(std::size_t{0}, groups.size(), [&](std::size_t g) {
    const ObjectGroup& group = groups[g];
    std::size_t points = 0;
    for (const std::uint32_t c : group.cubes) points += grid.points_of(c).size();
    if (group.cubes.size() < kFewest || points < kFewestPoints) return;
    const ObjectShape shape = shape_of(grid, group, plates);
    if (is_sheet(shape) || std::max(shape.length, shape.top - shape.bottom) < kSmallest) return;
    const auto has_piece = [&](const ModelEntity& entity) {
      if (entity.label == EntityLabel::wall) return is_in_wall(shape, entity) || is_edge_of(shape, entity);
      return is_ground(entity.label) && is_face_under(shape, entity);
    };
    if (is_of_floor(shape) || is_of_stairs(grid, group, steps) ||
        std::any_of(entities.begin(), entities.end(), has_piece))
      return;
    const ObjectFeatures features = features_of(grid, group, shape, entities);
    const ObjectClass kind = classify(shape, features, open.contains(shape.middle));
    if (!kind.building || options.building_too) things[g] = Thing{object_of(shape, kind), features};
  });
  std::map<ObjectKind, int> count;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (!things[g]) continue;
    ModelObject& object = things[g]->object;
    object.name = std::string(to_string(object.kind)) + " " + std::to_string(++count[object.kind]);
    for (const std::uint32_t c : groups[g].cubes) {
      for (const std::uint32_t i : grid.points_of(c))
        found.object_of[i] = static_cast<std::uint32_t>(found.objects.size());
    }
    found.objects.push_back(std::move(object));
    found.features.push_back(things[g]->features);
  }
  relate(found.objects);
  return found;
}

}  // namespace parhelion::semantic
