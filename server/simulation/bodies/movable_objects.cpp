#include "server/simulation/bodies/movable_objects.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "protocols/shape_mesh.hpp"
#include "server/simulation/building/building.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kSmallest = 0.05, kLargest = 2.5;  // m
constexpr double kHeaviest = 300;                   // kg
constexpr double kReach = 0.15;  // m that a scanned box may be wrong: it is moved that far, not farther
constexpr double kStep = 0.01;   // m between the places that are tried

/// kg/m^3 of the whole box, air between the legs included.
double density(ObjectKind kind) {
  switch (kind) {
    case ObjectKind::chair:
      return 30;
    case ObjectKind::table:
    case ObjectKind::bed:
      return 45;
    case ObjectKind::sofa:
    case ObjectKind::bin:
    case ObjectKind::plant:
      return 60;
    case ObjectKind::shelf:
    case ObjectKind::object:
      return 100;
    case ObjectKind::box:
      return 120;
    case ObjectKind::cupboard:
    case ObjectKind::counter:
      return 150;
    case ObjectKind::person:
      return 250;
    case ObjectKind::car:
    case ObjectKind::kerb:
      break;
  }
  return 200;
}

double mass_of(const ModelObject& object) { return std::max(0.1, density(object.kind) * object.size.prod()); }

Material material_of(ObjectKind kind) {
  switch (kind) {
    case ObjectKind::chair:
    case ObjectKind::sofa:
      return {{0.10F, 0.13F, 0.20F}, 0.8F, 0, 0.5F};
    case ObjectKind::plant:
      return {{0.05F, 0.20F, 0.06F}, 0.8F, 0, 0.5F};
    case ObjectKind::bin:
      return {{0.20F, 0.21F, 0.22F}, 0.5F, 0, 0.5F};
    default:
      return {{0.42F, 0.32F, 0.22F}, 0.7F, 0, 0.6F};
  }
}

Shape box(const Eigen::Vector3d& size, const Eigen::Vector3d& center, const Material& material) {
  return {ShapeKind::box, size, Transform<Body, ShapeFrame>(Eigen::Quaterniond::Identity(), center),
          material};
}

Transform<Map, Body> underside(const ModelObject& object) {
  return Transform<Map, Body>(object.T_map_body.isometry() *
                              Eigen::Translation3d(0, 0, -object.size.z() / 2));
}

double bottom_of(const ModelObject& object) { return underside(object).translation().z(); }

/// A plate of the whole plan with its top at `top`, on four legs at the corners.
void add_plate(const Eigen::Vector3d& size, double top, double thickness, double leg,
               const Material& material, std::vector<Shape>& shapes) {
  const double length = top - thickness;
  shapes.push_back(box({size.x(), size.y(), thickness}, {0, 0, length + thickness / 2}, material));
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      const Eigen::Vector2d corner = 0.5 * (size.head<2>().array() - leg);
      shapes.push_back(box({leg, leg, length}, {x * corner.x(), y * corner.y(), length / 2}, material));
    }
  }
}

/// From the middle of the seat to the back, along x or y of the body.
Eigen::Vector2d direction_of_back(const ModelObject& chair, double seat) {
  constexpr double kOverSeat = 0.1;  // m
  const Transform<Body, Map> T_body_map = underside(chair).inverse();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3f& vertex : chair.mesh.vertices) {
    const Eigen::Vector3d p = T_body_map * Eigen::Vector3d(vertex.cast<double>());
    if (p.z() > seat + kOverSeat) sum += p.head<2>().cwiseQuotient(chair.size.head<2>());
  }
  if (sum.isZero(0)) return {-1, 0};
  if (std::abs(sum.x()) >= std::abs(sum.y())) return {std::copysign(1.0, sum.x()), 0};
  return {0, std::copysign(1.0, sum.y())};
}

std::vector<Shape> chair_boxes(const ModelObject& chair) {
  constexpr double kSeat = 0.47, kSeatOfHeight = 0.55, kThickness = 0.05, kLeg = 0.04,
                   kLowestBack = 0.15;  // m
  const Eigen::Vector3d& size = chair.size;
  const Material material = material_of(chair.kind);
  const double lower = std::min(kSeat, kSeatOfHeight * size.z());
  const bool has_back = size.z() - lower > kLowestBack;
  const double seat = has_back ? lower : size.z();
  std::vector<Shape> shapes;
  add_plate(size, seat, std::min(kThickness, seat / 4), std::min(kLeg, size.head<2>().minCoeff() / 4),
            material, shapes);
  if (!has_back) return shapes;
  const Eigen::Vector2d back = direction_of_back(chair, seat);
  const double depth = std::min(kThickness, size.head<2>().minCoeff() / 4);
  const Eigen::Vector2d at = back.cwiseProduct(0.5 * (size.head<2>().array() - depth).matrix());
  const Eigen::Vector3d extent(back.x() != 0 ? depth : size.x(), back.y() != 0 ? depth : size.y(),
                               size.z() - seat);
  shapes.push_back(box(extent, {at.x(), at.y(), seat + extent.z() / 2}, material));
  return shapes;
}

std::vector<Shape> table_boxes(const ModelObject& table) {
  constexpr double kTop = 0.05, kLeg = 0.06;  // m
  std::vector<Shape> shapes;
  add_plate(table.size, table.size.z(), std::min(kTop, table.size.z() / 4),
            std::min(kLeg, table.size.head<2>().minCoeff() / 4), material_of(table.kind), shapes);
  return shapes;
}

/// What collides instead of its box; empty: its box.
std::vector<Shape> pieces_of(const ModelObject& object) {
  if (object.kind == ObjectKind::chair) return chair_boxes(object);
  if (object.kind == ObjectKind::table) return table_boxes(object);
  return {};
}

std::optional<Shape> surface_of(const ModelObject& object) {
  if (object.mesh.empty()) return std::nullopt;
  const Transform<Body, Map> T_body_map = underside(object).inverse();
  std::vector<Eigen::Vector3f> vertices;
  for (const Eigen::Vector3f& vertex : object.mesh.vertices)
    vertices.push_back((T_body_map * Eigen::Vector3d(vertex.cast<double>())).cast<float>());
  auto made = make_shape_mesh(std::move(vertices), object.mesh.triangles);
  if (!made) return std::nullopt;
  return Shape{ShapeKind::mesh, made->size,
               Transform<Body, ShapeFrame>(Eigen::Quaterniond::Identity(), made->center),
               material_of(object.kind), made->mesh};
}

bool is_of_reasonable_size(const ModelObject& object) {
  return object.T_map_body.finite() && object.T_map_body.rotation()(2, 2) > 1 - 1e-6 &&
         object.size.allFinite() && object.size.minCoeff() >= kSmallest &&
         object.size.maxCoeff() <= kLargest && mass_of(object) <= kHeaviest;
}

/// Moves objects to where bodies can rest, in the site without its meshes.
class Resting {
 public:
  explicit Resting(const Building& building) : building_(building) {}

  /// Call for supports before what they carry. False: there is no such place within kReach.
  bool put(ModelObject& object) {
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    if (const auto support = placed_.find(object.on); support != placed_.end()) {
      moved = support->second.moved;
      moved.z() = support->second.top - bottom_of(object);
    } else if (object.on.empty()) {
      moved.z() = building_.floor_height(object.T_map_body.translation().head<2>()) - bottom_of(object);
    }
    if (std::abs(moved.z()) > kReach) return false;
    shift(object, moved);
    const auto out = displacement_out(object);
    if (!out) return false;
    shift(object, {out->x(), out->y(), 0});
    moved.head<2>() += *out;
    placed_[object.name] = {moved, bottom_of(object) + object.size.z()};
    return true;
  }

 private:
  struct Placed {
    Eigen::Vector3d moved;  // m, map
    double top;             // m, z
  };

  static void shift(ModelObject& object, const Eigen::Vector3d& by) {
    if (by.isZero(0)) return;
    object.T_map_body = Transform<Map, Body>(Eigen::Translation3d(by) * object.T_map_body.isometry());
    for (Eigen::Vector3f& vertex : object.mesh.vertices) vertex += by.cast<float>();
  }

  /// The shortest of the displacements tried after which the box is in no wall.
  std::optional<Eigen::Vector2d> displacement_out(const ModelObject& object) {
    constexpr int kDirections = 16;
    for (int ring = 0; ring * kStep <= kReach; ++ring) {
      for (int i = 0; i < (ring == 0 ? 1 : kDirections); ++i) {
        const double angle = 2 * std::numbers::pi * i / kDirections;
        const Eigen::Vector2d by = ring * kStep * Eigen::Vector2d(std::cos(angle), std::sin(angle));
        if (is_free(object, by)) return by;
      }
    }
    return std::nullopt;
  }

  bool is_free(const ModelObject& object, const Eigen::Vector2d& by) {
    Pose2 pose = planar_pose(object.T_map_body);
    pose.x += by.x();
    pose.y += by.y();
    Footprint placed;
    place(make_rectangle(object.size.x(), object.size.y()), pose, placed);
    const double bottom = bottom_of(object);
    near_.clear();
    building_.near(placed.center, placed.bound, bottom + 0.02, bottom + object.size.z(), near_);
    return std::none_of(near_.begin(), near_.end(), [&](const FixedObstacle* obstacle) {
      return signed_distance(placed, obstacle->footprint) < 0;
    });
  }

  const Building& building_;
  std::map<std::string, Placed> placed_;  // by name
  std::vector<const FixedObstacle*> near_;
};

}  // namespace

Result<std::vector<ModelObject>> take_movable(SemanticModel& model, const std::vector<ModelObject>& objects) {
  SemanticModel bare;
  bare.entities = model.entities;
  const auto building = Building::create(bare);
  if (!building) return building.error();
  std::set<std::string_view> entities;
  for (const ModelEntity& entity : model.entities) entities.insert(entity.name);

  std::vector<std::size_t> upwards(objects.size());
  std::iota(upwards.begin(), upwards.end(), 0);
  std::stable_sort(upwards.begin(), upwards.end(), [&](std::size_t a, std::size_t b) {
    return bottom_of(objects[a]) < bottom_of(objects[b]);
  });
  Resting resting(**building);
  std::vector<std::optional<ModelObject>> taken(objects.size());
  for (const std::size_t i : upwards) {
    ModelObject object = objects[i];
    if (!object.movable || entities.contains(object.name) || !is_of_reasonable_size(object)) continue;
    const auto mesh = std::find_if(model.meshes.begin(), model.meshes.end(),
                                   [&](const ModelMesh& each) { return each.name == object.name; });
    if (mesh != model.meshes.end()) object.mesh = *mesh;
    if (!resting.put(object)) continue;
    if (mesh != model.meshes.end()) model.meshes.erase(mesh);
    taken[i] = std::move(object);
  }
  std::vector<ModelObject> bodies;
  for (auto& object : taken)
    if (object) bodies.push_back(std::move(*object));
  return bodies;
}

AgentDefinition object_agent(const ModelObject& object) {
  AgentDefinition agent;
  agent.name = object.name;
  agent.kind = AgentKind::box;
  agent.T_map_base = Transform<Map, Base>(underside(object).isometry());
  agent.size = object.size;
  agent.mass = mass_of(object);
  return agent;
}

AgentForm object_form(const ModelObject& object) {
  return {
      ShapeKind::box,   object.size, mass_of(object), false, make_rectangle(object.size.x(), object.size.y()),
      pieces_of(object)};
}

BodyDefinition object_body(const ModelObject& object, BodyId id) {
  BodyDefinition body{id, object.name, to_string(object.kind), BodyOwner::agent, true, {}};
  if (auto surface = surface_of(object)) {
    body.shapes = {std::move(*surface)};
  } else {
    body.shapes = pieces_of(object);
    if (body.shapes.empty())
      body.shapes = {box(object.size, {0, 0, object.size.z() / 2}, material_of(object.kind))};
  }
  return body;
}

}  // namespace parhelion::simulation
