// A door: a leaf that turns on a hinge, by physics (levels 1 and 2, drawn doors) or by reports of sensors and
// the instructor (real doors at level 3).
#pragma once

#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocols/door.hpp"
#include "protocols/event.hpp"
#include "protocols/scenario.hpp"
#include "protocols/scene.hpp"
#include "server/simulation/building/planar.hpp"
#include "server/simulation/physics/physics.hpp"

namespace parhelion::simulation {

inline constexpr double kDoorOpened = 10 * std::numbers::pi / 180;  // rad: from this angle a door is open

/// Which doors of a building are moved by the physics, and the scenario's door settings.
struct DoorRules {
  int level = 3;
  std::vector<DoorSettings> settings;
};

/// The last to touch a door: recorded as the cause when it opens or breaks.
struct DoorToucher {
  std::string name;
  PairKind pair = PairKind::none;
  bool undetectable = false;
  SimulationTime at;
};

struct Door {
  ModelEntity in_model;  ///< as in the model
  Hinge hinge;
  DoorSettings settings;
  std::string place;         ///< in the semantic net: "in wall 7"
  BodyId id = 0;             ///< of its body...
  std::size_t body = 0;      ///< ...and its index in the building's bodies
  std::size_t obstacle = 0;  ///< index in the building's obstacles
  PhysicsHandle handle = 0;
  PhysicsHandle anchor = 0;                ///< of a dynamic door: the fixed body of its hinge...
  JointHandle joint = 0;                   ///< ...and the hinge
  bool dynamic = false;                    ///< moved by the physics; else set by commands and reports
  Footprint outline;                       ///< of the upright leaf, about its centre
  Footprint space;                         ///< area in the opening (map); bodies in it are in the door...
  double space_bottom = 0, space_top = 0;  ///< ...between these heights, m

  // At the newest step.
  RigidState rigid;  ///< of the leaf's centre
  double angle = 0;  ///< rad, of the hinge
  std::uint32_t epoch = 0;
  bool known = true;                      ///< false: a real door with unknown angle
  bool unhinged = false;                  ///< off its hinge: a free body
  bool open = false;                      ///< as in the newest event
  bool moved = false;                     ///< its state differs from the building's
  bool turning = false;                   ///< a kinematic leaf has a velocity
  std::optional<double> seen, commanded;  ///< rad of the hinge, from the sensors and the instructor
  std::vector<double> impulses;           ///< N s through the hinge in the newest steps, a ring
  std::size_t next_impulse = 0;
  DoorToucher toucher;
  std::vector<std::string> inside;  ///< in its free space, ascending

  double opening() const { return opening_of(hinge, angle); }
  bool is_turned_open() const { return std::abs(opening()) > kDoorOpened; }
  /// Whether somebody at p (map, m) pushes it open by walking on, and far enough to pass.
  bool opens_when_pushed_from(const Eigen::Vector2d& p) const;
};

/// A door of the model at its initial angle by the rules; body, obstacle and handle are set by the building.
/// `spaces`: the free spaces of the model.
Door make_door(const ModelEntity& entity, const std::vector<ModelEntity>& spaces, const DoorRules& rules);

/// Adds it to the physics at its current angle; sets handle, anchor and joint.
void hang_door(Physics& physics, Door& door);
/// Removes the hinge of a dynamic door from the physics.
void unhang_door(Physics& physics, const Door& door);

/// Visible and colliding shapes of a leaf: its panel, and handles on both sides if it is dynamic.
std::vector<Shape> leaf_shapes(const Door& door);

/// Planar outline, bottom and top of a box of the model, in any orientation.
Footprint projection(const Transform<Map, Body>& T_map_body, const Eigen::Vector3d& size, double& bottom,
                     double& top);

}  // namespace parhelion::simulation
