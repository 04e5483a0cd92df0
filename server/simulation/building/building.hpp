// The modelled building: fixed bodies for the physics, footprints for planar computations.
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
#include "server/simulation/building/doors.hpp"
#include "server/simulation/building/model_net.hpp"
#include "server/simulation/building/planar.hpp"
#include "server/simulation/physics/physics.hpp"

namespace parhelion::simulation {

/// An obstacle of the building.
struct FixedObstacle {
  Footprint footprint;  ///< over its whole height, in the map
  double bottom = 0;    ///< m, z
  double top = 0;
  std::string name;
  EntityLabel label = EntityLabel::unknown;
  bool is_virtual = false;
  PhysicsHandle handle = 0;
  /// Contacts of the real robot with it are computed from distance: false for doors moved by the physics and
  /// for doors with unknown angle.
  bool is_measured = true;
  bool opens_when_pushed = false;  ///< a door leaf that can be pushed open
  std::string relation = {};       ///< ModelNet::place: "in wall 7", "of stairs 1"; empty: unknown
};

/// Constant after enter(), except for its door leaves.
class Building {
 public:
  /// The expensive part; independent of the simulation, so that another thread may do it.
  static Result<std::shared_ptr<Building>> create(const SemanticModel& model);

  /// Adds it to the physics; call once. Body ids start at `first_body`, one for each entity of the model.
  /// Returns the doors, ascending id, which the caller owns from now on.
  std::vector<Door> enter(Physics& physics, BodyId first_body, const DoorRules& rules);

  /// Updates the leaf's outline to the door's current angle.
  void move_leaf(const Door& door);

  /// Removes its bodies from the physics; the rest stays readable, for the history.
  void leave(Physics& physics) const;

  const std::vector<std::shared_ptr<const BodyDefinition>>& definitions() const { return definitions_; }
  /// States as in the model; for doors (`door_bodies`) a record may have newer ones.
  const std::vector<BodyState>& states() const { return states_; }
  const std::vector<std::size_t>& door_bodies() const { return door_bodies_; }
  const ModelNet& net() const { return net_; }
  const std::vector<FixedObstacle>& obstacles() const { return obstacles_; }
  /// z of the floor under (x, y): the highest top of the floors there; outside all floors, the lowest
  /// floor's; 0 without any.
  double floor_height(const Eigen::Vector2d& p) const { return floor_height(make_disc(p, 0)); }
  double floor_height(const Footprint& point) const;
  /// Appends the obstacles with a bounding circle within `range` of `p` and between the heights, ascending
  /// index.
  void near(const Eigen::Vector2d& p, double range, double bottom, double top,
            std::vector<const FixedObstacle*>& found) const;
  /// Of all obstacles in the plane; empty without any.
  const Eigen::AlignedBox2d& extent() const { return extent_; }
  /// Of obstacles and floors in the plane; empty without any.
  const Eigen::AlignedBox2d& site() const { return site_; }
  /// For a mesh, which is many obstacles with one handle, the first.
  const FixedObstacle* by_handle(PhysicsHandle handle) const;

 private:
  struct Floor {
    Footprint footprint;
    Eigen::Vector3d normal;  ///< of the upper side, unit, upwards
    Eigen::Vector3d point;   ///< on it
    double lowest = 0;       ///< m, z of its lowest corner
    /// z of the upper side at p: a floor fitted to scans is never exactly level.
    double height(const Eigen::Vector2d& p) const;
  };
  struct Box {
    Eigen::Vector3d size;
    bool floor;
    std::optional<std::size_t> obstacle;  ///< index of its obstacle, if it is one
    std::optional<ModelEntity> door;
  };
  struct Mesh {
    std::shared_ptr<FixedMesh> shape;
    std::size_t first, end;  ///< its obstacles
  };
  /// `number`: index of the entity in its model, from which its body id is derived.
  void add(const ModelEntity& entity, BodyId number);
  void add(const ModelMesh& mesh);
  void add_door(const ModelEntity& entity);
  void build_grid();

  // Prepared by create() for enter(); boxes_, parts_ and states_ have the same length.
  std::vector<Box> boxes_;
  std::vector<BodyDefinition> parts_;
  std::vector<Mesh> meshes_;
  std::vector<ModelEntity> spaces_;  ///< free spaces of doors

  std::vector<std::shared_ptr<const BodyDefinition>> definitions_;
  std::vector<BodyState> states_;
  std::vector<PhysicsHandle> handles_;    // of all bodies in the physics
  std::vector<FixedObstacle> obstacles_;  // ascending handle
  std::vector<Floor> floors_;
  double lowest_floor_ = 0;
  Eigen::AlignedBox2d extent_, site_;
  ModelNet net_;
  std::vector<std::size_t> door_bodies_;  // ascending index into states_
  struct Swing {
    std::size_t obstacle;
    Footprint disc;  // the area swept by the leaf
  };
  std::vector<Swing> swings_;         // ascending obstacle
  std::vector<std::uint32_t> loose_;  // obstacles without a fixed position: unhinged doors

  void add_to_grid(std::uint32_t index, const Footprint& footprint);
  /// The area an obstacle can cover, at any angle.
  const Footprint& covered(std::size_t obstacle) const;
  /// First and last of `count` cells within `reach` of `at` (m from the grid's origin).
  std::pair<int, int> cell_range(double at, double reach, int count) const;

  // Obstacles by cell of a regular grid.
  static constexpr double kCell = 2.0;        // m
  static constexpr double kMaxCells = 250e3;  // a model of a whole campus gets larger cells
  double cell_ = kCell;
  Eigen::Vector2d grid_origin_ = Eigen::Vector2d::Zero();
  int columns_ = 0, rows_ = 0;
  std::vector<std::vector<std::uint32_t>> cells_;
};

}  // namespace parhelion::simulation
