#include "server/station/foxglove/scene.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <vector>

#include "server/station/foxglove/scene_entity.hpp"

namespace parhelion::station::foxglove {
namespace {

constexpr int kDeletionsSent = 100;  // ten seconds of /scene

void add_solid(const Eigen::Isometry3d& T_map_solid, const Eigen::Vector3d& size, const Colour& colour,
               JsonText& list) {
  list.open('{').key("pose").pose(T_map_solid).key("size").vector(size).key("color");
  write_colour(colour, list);
}

void add_sphere(const Eigen::Isometry3d& T_map_sphere, double radius, const Colour& colour, JsonText& list) {
  add_solid(T_map_sphere, Eigen::Vector3d::Constant(2 * radius), colour, list);
  list.close('}');
}

void add_cylinder(const Eigen::Isometry3d& T_map_cylinder, double radius, double height, const Colour& colour,
                  JsonText& list) {
  add_solid(T_map_cylinder, {2 * radius, 2 * radius, height}, colour, list);
  list.key("bottom_scale").integer(1).key("top_scale").integer(1).close('}');
}

void add_shape(const Shape& shape, const Eigen::Isometry3d& T_map_body, Primitives& to) {
  const Eigen::Isometry3d T = T_map_body * shape.T_body_shape.isometry();
  const Colour colour = seen(shape.material.albedo);
  switch (shape.kind) {
    case ShapeKind::mesh:
      break;  // drawn by MeshScene
    case ShapeKind::box:
      add_solid(T, shape.size, colour, to.cubes);
      to.cubes.close('}');
      break;
    case ShapeKind::sphere:
      add_sphere(T, shape.size.x(), colour, to.spheres);
      break;
    case ShapeKind::cylinder:
      add_cylinder(T, shape.size.x(), shape.size.z(), colour, to.cylinders);
      break;
    case ShapeKind::capsule:
      add_cylinder(T, shape.size.x(), shape.size.z(), colour, to.cylinders);
      for (const double end : {-0.5, 0.5}) {
        const Eigen::Isometry3d T_end = T * Eigen::Translation3d(0, 0, end * shape.size.z());
        add_sphere(T_end, shape.size.x(), colour, to.spheres);
      }
      break;
  }
}

constexpr Colour kPersonColour{1, 0.36, 0.62, 1};
constexpr double kOverFloor = 0.03;  // m, of lines

/// A ring in which the person is with 2 sigma, beside the person's own radius.
void add_ring(const WorldMessage::Entry& body, const WorldMessage::Person& person, JsonText& list) {
  constexpr int closed = 1, corners = 24;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(person.covariance);
  const Eigen::Vector2d half =
      2 * axes.eigenvalues().cwiseMax(0).cwiseSqrt() + Eigen::Vector2d::Constant(person.radius);
  list.open('{').key("type").integer(closed).key("pose");
  list.pose(Eigen::Isometry3d(
      Eigen::Translation3d(body.T_map_body.translation() + Eigen::Vector3d(0, 0, kOverFloor))));
  list.key("thickness").number(0.03).key("scale_invariant").boolean(false).key("points").open('[');
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners;
    const Eigen::Vector2d p =
        axes.eigenvectors() * half.cwiseProduct(Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    list.open('{').key("x").number(p.x()).key("y").number(p.y()).key("z").number(0.0).close('}');
  }
  list.close(']').key("color");
  write_colour(kPersonColour, list);
  list.key("colors").open('[').close(']').key("indices").open('[').close(']').close('}');
}

/// As long as the way in a second.
void add_velocity(const WorldMessage::Entry& body, JsonText& list) {
  const double speed = body.velocity.head<2>().norm();
  if (speed < 0.15) return;
  const Eigen::Isometry3d T =
      Eigen::Translation3d(body.T_map_body.translation() + Eigen::Vector3d(0, 0, kOverFloor)) *
      Eigen::AngleAxisd(std::atan2(body.velocity.y(), body.velocity.x()), Eigen::Vector3d::UnitZ());
  const double head = std::min(0.2, speed / 2);
  list.open('{').key("pose").pose(T).key("shaft_length").number(speed - head);
  list.key("shaft_diameter").number(0.05).key("head_length").number(head).key("head_diameter").number(0.15);
  list.key("color");
  write_colour(kPersonColour, list);
  list.close('}');
}

void add_person_marks(const WorldMessage& world, const WorldMessage::Entry& body, Primitives& to) {
  const auto person =
      std::find_if(world.persons.begin(), world.persons.end(),
                   [&](const WorldMessage::Person& each) { return each.entity == body.entity; });
  if (person == world.persons.end()) return;
  add_ring(body, *person, to.lines);
  add_velocity(body, to.arrows);
}

const char* word(BodyOwner owner) {
  static constexpr const char* words[] = {"agent", "robot", "building", "real person"};
  return words[static_cast<std::size_t>(owner)];
}

/// Calls `use` with the first body of each entity and the end of its bodies, which are consecutive.
template <class Use>
void for_each_entity(const WorldMessage& world, Use use) {
  for (auto first = world.bodies.begin(); first != world.bodies.end();) {
    auto end = first;
    while (end != world.bodies.end() && end->entity == first->entity) ++end;
    use(first, end);
    first = end;
  }
}

void open_update(JsonText& out) {
  out.clear();
  out.open('{').key("deletions").open('[').close(']').key("entities").open('[');
}

Colour building_colour(EntityLabel label) {
  switch (label) {
    case EntityLabel::wall:
      return {0.75, 0.74, 0.70, 0.5};  // translucent, because scan returns lie inside it
    case EntityLabel::floor:
      return {0.35, 0.36, 0.38, 1};
    case EntityLabel::ceiling:
      return {0.85, 0.85, 0.85, 0.5};
    case EntityLabel::door:
      return {0.55, 0.36, 0.20, 1};
    case EntityLabel::stairs:
      return {0.35, 0.50, 0.70, 1};
    case EntityLabel::ramp:
      return {0.40, 0.44, 0.50, 1};
    case EntityLabel::window:
      return {0.60, 0.80, 0.95, 0.4};
    case EntityLabel::pillar:
      return {0.62, 0.60, 0.66, 0.5};
    case EntityLabel::wall_above_door:
      return {0.75, 0.74, 0.70, 0.6};
    case EntityLabel::unknown:
    case EntityLabel::free_space:
      break;
  }
  return {0.50, 0.45, 0.55, 0.5};
}

bool overhead(EntityLabel label) {
  return label == EntityLabel::ceiling || label == EntityLabel::wall_above_door;
}

void write_mesh(const ModelMesh& mesh, std::int64_t stamp, JsonText& out) {
  Primitives what;
  add_triangles(Eigen::Isometry3d::Identity(), mesh.vertices, mesh.triangles,
                building_colour(EntityLabel::unknown), what.triangles);
  write_entity(stamp, "map", mesh.name, {{"label", "unknown"}}, what, out);
}

}  // namespace

void WorldScene::write(const WorldMessage& world, const simulation::EntityShapes& shapes, JsonText& out) {
  const Shape unknown{ShapeKind::sphere, Eigen::Vector3d::Constant(0.1), {}, {{1, 0, 1}, 0.6F, 0, 0}};
  next_.clear();
  for (const auto& body : world.bodies) next_.insert(body.entity);
  out.clear();
  out.open('{').key("deletions").open('[');
  for (const std::string& name : there_)
    if (next_.count(name) == 0) gone_[name] = kDeletionsSent;
  std::erase_if(gone_, [this](const auto& each) { return each.second == 0 || next_.count(each.first) > 0; });
  for (auto& [name, left] : gone_) {
    --left;
    out.open('{').key("timestamp").time(world.stamp.ns).key("type").integer(0);
    out.key("id").string(name).close('}');
  }
  there_.swap(next_);
  out.close(']').key("entities").open('[');
  for_each_entity(world, [&](auto first, auto end) {
    Primitives what;
    for (auto body = first; body != end; ++body) {
      const std::vector<Shape>* known = shapes.find(body->entity, body->part);
      if (known == nullptr) add_shape(unknown, body->T_map_body.isometry(), what);
      for (std::size_t i = 0; known && i < known->size(); ++i)
        add_shape((*known)[i], body->T_map_body.isometry(), what);
    }
    if (first->owner == BodyOwner::real_person) add_person_marks(world, *first, what);
    const char* kind = first->owner == BodyOwner::building ? "door" : to_string(first->kind);
    write_entity(world.stamp.ns, "map", first->entity, {{"owner", word(first->owner)}, {"kind", kind}}, what,
                 out);
  });
  out.close(']').close('}');
}

void WorldScene::write_names(const WorldMessage& world, JsonText& out) {
  constexpr int all = 1;
  out.clear();
  out.open('{').key("deletions").open('[').open('{').key("timestamp").time(world.stamp.ns);
  out.key("type").integer(all).key("id").unescaped("").close('}').close(']').key("entities").open('[');
  for_each_entity(world, [&](auto first, auto) {
    if (first->owner == BodyOwner::building) return;
    Primitives what;
    const Eigen::Isometry3d above(
        Eigen::Translation3d(first->T_map_body.translation() + Eigen::Vector3d(0, 0, 2)));
    what.texts.open('{').key("pose").pose(above).key("billboard").boolean(true).key("font_size").number(0.25);
    what.texts.key("scale_invariant").boolean(false).key("color");
    write_colour({1, 1, 1, 1}, what.texts);
    what.texts.key("text").string(first->entity).close('}');
    write_entity(world.stamp.ns, "map", first->entity, {}, what, out);
  });
  out.close(']').close('}');
}

bool write_building(const SemanticModel& model, std::int64_t stamp, BuildingPart part, JsonText& out) {
  bool too_large = false;
  open_update(out);
  for (const ModelEntity& entity : model.entities) {
    if (!is_solid(entity) || entity.label == EntityLabel::door) continue;
    if (overhead(entity.label) != (part == BuildingPart::overhead)) continue;
    Primitives what;
    add_solid(entity.T_map_body.isometry(), entity.size, building_colour(entity.label), what.cubes);
    what.cubes.close('}');
    write_entity(stamp, "map", entity.name, {{"label", to_string(entity.label)}}, what, out);
  }
  if (part == BuildingPart::standing) {
    for (const ModelMesh& mesh : model.meshes) {
      if (mesh.triangles.size() > kMaxMeshTriangles)
        too_large = true;
      else
        write_mesh(mesh, stamp, out);
    }
  }
  out.close(']').close('}');
  return too_large;
}

}  // namespace parhelion::station::foxglove
