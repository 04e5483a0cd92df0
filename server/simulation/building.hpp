// The modelled building: fixed bodies for the physics, footprints for everything that is computed in the
// plane.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocols/model.hpp"
#include "protocols/scene.hpp"
#include "protocols/status.hpp"
#include "protocols/world.hpp"
#include "server/simulation/doors.hpp"
#include "server/simulation/model_net.hpp"
#include "server/simulation/physics.hpp"
#include "server/simulation/planar.hpp"

namespace parhelion::simulation {

/// Something of the building that stands in the way.
struct FixedObstacle {
  Footprint footprint;  ///< of its whole height, in the map
  double bottom = 0;    ///< m, z
  double top = 0;
  std::string name;
  EntityLabel label = EntityLabel::unknown;
  bool is_virtual = false;
  PhysicsHandle handle = 0;
  /// Contacts of the real robot with it are a distance: not with a door that physics moves, nor with one of
  /// which nobody knows how far it is open.
  bool is_measured = true;
  bool gives_way = false;     ///< a leaf that whoever pushes it opens
  std::string relation = {};  ///< ModelNet::place: "in wall 7", "of stairs 1"; empty: none is known
};

/// Constant after enter(), but for where its doors stand.
class Building {
 public:
  /// All that takes time; needs no simulation, so that another thread may do it.
  static Result<std::shared_ptr<Building>> create(const SemanticModel& model);

  /// Into the physics, once. Its bodies are numbered from `first_body`, one for each entity of the model.
  /// The doors, ascending id, are the caller's from now on.
  std::vector<Door> enter(Physics& physics, BodyId first_body, const DoorRules& rules);

  /// The leaf's outline as the door stands now.
  void move_leaf(const Door& door);

  /// Takes its bodies out of the physics again; the rest stays readable, for what is remembered of it.
  void leave(Physics& physics) const;

  const std::vector<std::shared_ptr<const BodyDefinition>>& definitions() const { return definitions_; }
  /// As the model draws them; of the doors, `door_bodies` among them, a record may know better.
  const std::vector<BodyState>& states() const { return states_; }
  const std::vector<std::size_t>& door_bodies() const { return door_bodies_; }
  const ModelNet& net() const { return net_; }
  const std::vector<FixedObstacle>& obstacles() const { return obstacles_; }
  /// z of the floor under (x, y): the highest top of the floors there; where the model has none there, the
  /// lowest floor's; 0 without any.
  double floor_height(const Eigen::Vector2d& p) const { return floor_height(make_disc(p, 0)); }
  double floor_height(const Footprint& point) const;
  /// Appends the obstacles whose bounding circle is within `range` of `p` and that are between the heights,
  /// ascending index.
  void near(const Eigen::Vector2d& p, double range, double bottom, double top,
            std::vector<const FixedObstacle*>& found) const;
  /// Of all obstacles in the plane; empty where there are none.
  const Eigen::AlignedBox2d& extent() const { return extent_; }
  /// Of obstacles and floors in the plane; empty where the model has none.
  const Eigen::AlignedBox2d& site() const { return site_; }
  /// Of a mesh, which is many obstacles with one handle, the first.
  const FixedObstacle* by_handle(PhysicsHandle handle) const;

 private:
  struct Floor {
    Footprint footprint;
    Eigen::Vector3d normal;  ///< of the upper side, unit, upwards
    Eigen::Vector3d point;   ///< on it
    double lowest = 0;       ///< m, z of its lowest corner
    /// z of the upper side at p: a floor that was fitted to scans is never quite level.
    double height(const Eigen::Vector2d& p) const;
  };
  struct Box {
    Eigen::Vector3d size;
    bool floor;
    std::optional<std::size_t> obstacle;  ///< that it is
    std::optional<ModelEntity> door;
  };
  struct Mesh {
    std::shared_ptr<FixedMesh> shape;
    std::size_t first, end;  ///< its obstacles
  };
  /// `number`: of the entity in its model; what its body's counts from.
  void add(const ModelEntity& entity, BodyId number);
  void add(const ModelMesh& mesh);
  void add_door(const ModelEntity& entity);
  void build_grid();

  // As create() leaves them for enter(); boxes_, parts_ and states_ are alike in length.
  std::vector<Box> boxes_;
  std::vector<BodyDefinition> parts_;
  std::vector<Mesh> meshes_;
  std::vector<ModelEntity> spaces_;  ///< free spaces of doors

  std::vector<std::shared_ptr<const BodyDefinition>> definitions_;
  std::vector<BodyState> states_;
  std::vector<PhysicsHandle> handles_;    // of all that is in the physics
  std::vector<FixedObstacle> obstacles_;  // ascending handle
  std::vector<Floor> floors_;
  double lowest_floor_ = 0;
  Eigen::AlignedBox2d extent_, site_;
  ModelNet net_;
  std::vector<std::size_t> door_bodies_;  // ascending index into states_
  struct Swing {
    std::size_t obstacle;
    Footprint disc;  // all that the leaf passes over
  };
  std::vector<Swing> swings_;         // ascending obstacle
  std::vector<std::uint32_t> loose_;  // obstacles that may lie anywhere: doors off their hinges

  void add_to_grid(std::uint32_t index, const Footprint& footprint);
  /// What an obstacle covers, whichever way it stands.
  const Footprint& covered(std::size_t obstacle) const;
  /// First and last cell, of `count` in a row, within `reach` of `at` (m from the grid's origin).
  std::pair<int, int> cell_range(double at, double reach, int count) const;

  // Which obstacles reach into each cell of a regular grid.
  static constexpr double kCell = 2.0;         // m
  static constexpr double kMostCells = 250e3;  // a model of a whole campus gets larger cells instead
  double cell_ = kCell;
  Eigen::Vector2d grid_origin_ = Eigen::Vector2d::Zero();
  int columns_ = 0, rows_ = 0;
  std::vector<std::vector<std::uint32_t>> cells_;
};

}  // namespace parhelion::simulation
