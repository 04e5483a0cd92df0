#include "server/simulation/building/building.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>

#include "protocols/model_mesh.hpp"
#include "server/simulation/building/mesh_pieces.hpp"

namespace parhelion::simulation {
namespace {

Error entity_error(const ModelEntity& entity, const std::string& what) {
  return Error{"model entity '" + entity.name + "': " + what};
}

Status check(const ModelEntity& entity) {
  if (!entity.T_map_body.finite())
    return entity_error(entity, "its pose is not finite; expected metres and radians");
  if (!entity.size.allFinite() || entity.size.minCoeff() <= 0) {
    return entity_error(entity, "its size is not positive; expected three lengths in metres");
  }
  return {};
}

}  // namespace

Result<std::shared_ptr<Building>> Building::create(const SemanticModel& model) {
  auto building = std::make_shared<Building>();
  for (const ModelEntity& entity : model.entities) {
    if (Status status = check(entity); !status) return status.error();
  }
  for (const ModelMesh& mesh : model.meshes) {
    if (Status status = check_mesh(mesh); !status)
      return Error{"model mesh '" + mesh.name + "': " + status.error().message};
  }
  BodyId number = 0;
  for (const ModelEntity& entity : model.entities) {
    if (is_solid(entity)) building->add(entity, number);
    if (entity.label == EntityLabel::free_space && !entity.deleted) building->spaces_.push_back(entity);
    ++number;
  }
  building->net_ = ModelNet(model);
  for (const ModelMesh& mesh : model.meshes) {
    if (!mesh.empty()) building->add(mesh);
  }
  for (FixedObstacle& obstacle : building->obstacles_)
    obstacle.relation = building->net_.place(obstacle.name);
  for (std::size_t i = 0; i < building->floors_.size(); ++i) {
    const double height = building->floors_[i].lowest;
    building->lowest_floor_ = i == 0 ? height : std::min(building->lowest_floor_, height);
  }
  building->build_grid();
  building->site_ = building->extent_;
  for (const Floor& floor : building->floors_) {
    for (const Eigen::Vector2d& corner : floor.footprint.vertices) building->site_.extend(corner);
  }
  return building;
}

void Building::add(const ModelEntity& entity, BodyId number) {
  // Ground steeper than 45 degrees is a wrong label: treated as an obstacle like a wall.
  const bool floor = is_ground(entity.label) && entity.T_map_body.rotation()(2, 2) > 0.7;
  double bottom = 0, top = 0;
  Footprint footprint = projection(entity.T_map_body, entity.size, bottom, top);
  boxes_.push_back({entity.size, floor, std::nullopt, std::nullopt});
  if (entity.label == EntityLabel::door) add_door(entity);
  if (floor) {
    const Eigen::Matrix3d R = entity.T_map_body.rotation();
    const Eigen::Vector3d point = entity.T_map_body * Eigen::Vector3d(0, 0, entity.size.z() / 2);
    const double fall = (std::abs(R(2, 0)) * entity.size.x() + std::abs(R(2, 1)) * entity.size.y()) / 2;
    floors_.push_back({std::move(footprint), R.col(2), point, point.z() - fall});
  } else if (entity.label != EntityLabel::ceiling) {
    boxes_.back().obstacle = obstacles_.size();
    obstacles_.push_back(
        {std::move(footprint), bottom, top, entity.name, entity.label, entity.is_virtual, 0, true});
  }
  BodyDefinition body;
  body.id = number;
  body.entity = entity.name;
  body.part = to_string(entity.label);
  body.owner = BodyOwner::building;
  body.injectable = entity.is_virtual;
  body.moves = entity.label == EntityLabel::door;
  body.shapes.push_back({ShapeKind::box, entity.size, {}, entity.material});
  parts_.push_back(std::move(body));
  BodyState state;
  state.id = number;
  state.T_map_body = entity.T_map_body;
  states_.push_back(state);
}

void Building::add_door(const ModelEntity& entity) {
  const Hinge hinge = hinge_of(entity);
  const Eigen::Vector3d axis = entity.T_map_body * Eigen::Vector3d(hinge.axis.x(), hinge.axis.y(), 0);
  boxes_.back().door = entity;
  door_bodies_.push_back(states_.size());
  swings_.push_back({obstacles_.size(), make_disc(axis.head<2>(), leaf_reach(entity, hinge))});
}

void Building::add(const ModelMesh& mesh) {
  const std::size_t first = obstacles_.size();
  for (MeshPiece& piece : mesh_pieces(mesh)) {
    obstacles_.push_back({std::move(piece.footprint), piece.bottom, piece.top, mesh.name,
                          EntityLabel::unknown, false, 0, true});
  }
  meshes_.push_back({make_fixed_mesh(mesh), first, obstacles_.size()});
}

std::vector<Door> Building::enter(Physics& physics, BodyId first_body, const DoorRules& rules) {
  std::vector<Door> doors;
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    parts_[i].id = states_[i].id += first_body;
    if (boxes_[i].door) {
      Door door = make_door(*boxes_[i].door, spaces_, rules);
      door.place = net_.place(door.in_model.name);
      door.id = states_[i].id;
      door.body = i;
      door.obstacle = *boxes_[i].obstacle;
      hang_door(physics, door);
      parts_[i].injectable = obstacles_[door.obstacle].is_virtual = door.in_model.is_virtual;
      parts_[i].shapes = leaf_shapes(door);
      states_[i].known = door.known;
      states_[i].T_map_body = door.rigid.T_map_body;
      handles_.push_back(door.handle);
      move_leaf(door);
      doors.push_back(std::move(door));
    } else {
      handles_.push_back(physics.add_fixed_box(states_[i].T_map_body, boxes_[i].size, boxes_[i].floor));
    }
    if (boxes_[i].obstacle) obstacles_[*boxes_[i].obstacle].handle = handles_.back();
    definitions_.push_back(std::make_shared<const BodyDefinition>(std::move(parts_[i])));
  }
  for (const Mesh& mesh : meshes_) {
    handles_.push_back(physics.add_fixed_mesh(*mesh.shape));
    for (std::size_t i = mesh.first; i < mesh.end; ++i) obstacles_[i].handle = handles_.back();
  }
  handles_.push_back(
      physics.add_floor(lowest_floor_));  // objects beside a floor's edge must not fall forever
  boxes_.clear();
  parts_.clear();
  meshes_.clear();
  spaces_.clear();
  return doors;
}

void Building::move_leaf(const Door& door) {
  FixedObstacle& leaf = obstacles_[door.obstacle];
  leaf.is_measured = !door.dynamic && door.known;
  leaf.opens_when_pushed = door.dynamic && !door.unhinged;
  const Transform<Map, Body>& T_map_leaf = door.rigid.T_map_body;
  if (!door.unhinged) {
    place(door.outline, planar_pose(T_map_leaf), leaf.footprint);
    return;
  }
  leaf.footprint = projection(T_map_leaf, door.in_model.size, leaf.bottom, leaf.top);
  const auto index = static_cast<std::uint32_t>(door.obstacle);
  if (std::find(loose_.begin(), loose_.end(), index) == loose_.end()) loose_.push_back(index);
}

void Building::leave(Physics& physics) const {
  for (const PhysicsHandle handle : handles_) physics.remove(handle);
}

double Building::Floor::height(const Eigen::Vector2d& p) const {
  const Eigen::Vector2d along = p - point.head<2>();
  return point.z() - normal.head<2>().dot(along) / normal.z();
}

double Building::floor_height(const Footprint& point) const {
  double height = lowest_floor_;
  bool found = false;
  for (const Floor& floor : floors_) {
    if (signed_distance(point, floor.footprint) > 0) continue;
    height = found ? std::max(height, floor.height(point.center)) : floor.height(point.center);
    found = true;
  }
  return height;
}

void Building::build_grid() {
  if (obstacles_.empty()) return;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (std::size_t i = 0; i < obstacles_.size(); ++i) {
    const Footprint& footprint = covered(i);
    for (const Eigen::Vector2d& v : footprint.vertices) {
      low = low.cwiseMin(v - Eigen::Vector2d::Constant(footprint.radius));
      high = high.cwiseMax(v + Eigen::Vector2d::Constant(footprint.radius));
    }
  }
  grid_origin_ = low;
  extent_ = {low, high};
  const Eigen::Vector2d extent = high - low;
  cell_ = std::max(kCell, std::sqrt(extent.x() * extent.y() / kMaxCells));
  cell_ = std::max(cell_, extent.maxCoeff() / kMaxCells);
  columns_ = static_cast<int>(std::floor(extent.x() / cell_)) + 1;
  rows_ = static_cast<int>(std::floor(extent.y() / cell_)) + 1;
  cells_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  for (std::uint32_t i = 0; i < obstacles_.size(); ++i) add_to_grid(i, covered(i));
}

const Footprint& Building::covered(std::size_t obstacle) const {
  const auto swing = std::lower_bound(swings_.begin(), swings_.end(), obstacle,
                                      [](const Swing& s, std::size_t index) { return s.obstacle < index; });
  const bool is_door = swing != swings_.end() && swing->obstacle == obstacle;
  return is_door ? swing->disc : obstacles_[obstacle].footprint;
}

void Building::add_to_grid(std::uint32_t index, const Footprint& footprint) {
  const Footprint square = make_rectangle(cell_, cell_);
  Footprint placed;
  const auto [first_column, last_column] =
      cell_range(footprint.center.x() - grid_origin_.x(), footprint.bound, columns_);
  const auto [first_row, last_row] =
      cell_range(footprint.center.y() - grid_origin_.y(), footprint.bound, rows_);
  for (int row = first_row; row <= last_row; ++row) {
    for (int column = first_column; column <= last_column; ++column) {
      place(square, {grid_origin_.x() + (column + 0.5) * cell_, grid_origin_.y() + (row + 0.5) * cell_, 0},
            placed);
      if (signed_distance(placed, footprint) <= 1e-9) {
        cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
               static_cast<std::size_t>(column)]
            .push_back(index);
      }
    }
  }
}

std::pair<int, int> Building::cell_range(double at, double reach, int count) const {
  const auto cell = [&](double x) {
    return static_cast<int>(std::clamp(std::floor(x / cell_), 0.0, static_cast<double>(count - 1)));
  };
  return {cell(at - reach), cell(at + reach)};
}

void Building::near(const Eigen::Vector2d& p, double range, double bottom, double top,
                    std::vector<const FixedObstacle*>& found) const {
  if (cells_.empty()) return;
  const auto [first_column, last_column] = cell_range(p.x() - grid_origin_.x(), range, columns_);
  const auto [first_row, last_row] = cell_range(p.y() - grid_origin_.y(), range, rows_);
  const std::size_t start = found.size();
  const auto take = [&](std::uint32_t i) {
    const FixedObstacle& obstacle = obstacles_[i];
    if (obstacle.top <= bottom || obstacle.bottom >= top) return;
    if ((obstacle.footprint.center - p).norm() - obstacle.footprint.bound > range) return;
    found.push_back(&obstacle);
  };
  for (int row = first_row; row <= last_row; ++row) {
    for (int column = first_column; column <= last_column; ++column) {
      const auto& cell = cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                                static_cast<std::size_t>(column)];
      for (const std::uint32_t i : cell) take(i);
    }
  }
  for (const std::uint32_t i : loose_) take(i);
  // Remove duplicates from several cells, and restore the model's order.
  std::sort(found.begin() + static_cast<std::ptrdiff_t>(start), found.end());
  found.erase(std::unique(found.begin() + static_cast<std::ptrdiff_t>(start), found.end()), found.end());
}

const FixedObstacle* Building::by_handle(PhysicsHandle handle) const {
  const auto at = std::lower_bound(obstacles_.begin(), obstacles_.end(), handle,
                                   [](const FixedObstacle& o, PhysicsHandle h) { return o.handle < h; });
  return at != obstacles_.end() && at->handle == handle ? &*at : nullptr;
}

}  // namespace parhelion::simulation
