// A door: a leaf that turns on a hinge, by physics (levels 1 and 2, drawn doors) or as sensors and the
// instructor report it (real doors at level 3).
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
#include "server/simulation/physics.hpp"
#include "server/simulation/planar.hpp"

namespace parhelion::simulation {

inline constexpr double kDoorOpened = 10 * std::numbers::pi / 180;  // rad: turned so far, a door is open

/// Where a building stands: which of its doors move by themselves, and the scenario's settings of them.
struct DoorRules {
  int level = 3;
  std::vector<DoorSettings> settings;
};

/// Who touched a door last: what opens it or breaks it is this one's doing.
struct DoorToucher {
  std::string name;
  PairKind pair = PairKind::none;
  bool unsensed = false;
  SimulationTime at;
};

struct Door {
  ModelEntity drawn;  ///< as the model has it
  Hinge hinge;
  DoorSettings settings;
  std::string place;         ///< in the net: "in wall 7"
  BodyId id = 0;             ///< of its body...
  std::size_t body = 0;      ///< ...and which of the building's it is
  std::size_t obstacle = 0;  ///< which of the building's
  PhysicsHandle handle = 0;
  PhysicsHandle anchor = 0;                ///< of a dynamic one: what its hinge is fixed to...
  JointHandle joint = 0;                   ///< ...and the hinge
  bool dynamic = false;                    ///< physics moves it; else it stands as it is commanded to
  Footprint outline;                       ///< of the upright leaf, about its centre
  Footprint space;                         ///< what it opens (map); who is in it is in the door...
  double space_bottom = 0, space_top = 0;  ///< ...between these heights, m

  // At the newest step.
  RigidState rigid;  ///< of the leaf's centre
  double angle = 0;  ///< rad, of the hinge
  std::uint32_t epoch = 0;
  bool known = true;                      ///< false: a real door of which nobody knows how far it is open
  bool unhinged = false;                  ///< pushed off: it lies about
  bool open = false;                      ///< as events have it
  bool moved = false;                     ///< its state is no longer the building's own
  bool turning = false;                   ///< a kinematic leaf had a velocity
  std::optional<double> seen, commanded;  ///< rad of the hinge, by the sensors and by the instructor
  std::vector<double> impulses;           ///< N s through the hinge in the newest steps, a ring
  std::size_t next_impulse = 0;
  DoorToucher toucher;
  std::vector<std::string> inside;  ///< of its free space, ascending

  double opening() const { return opening_of(hinge, angle); }
  bool is_turned_open() const { return std::abs(opening()) > kDoorOpened; }
  /// Whether somebody at p (map, m) who walks on against it pushes it open, and far enough to pass.
  bool gives_way_to(const Eigen::Vector2d& p) const;
};

/// A door of the model, standing as its rules have it; body, obstacle and handle are the building's to set.
/// `spaces`: the free spaces of the model.
Door make_door(const ModelEntity& entity, const std::vector<ModelEntity>& spaces, const DoorRules& rules);

/// Into the physics, where it stands; sets handle, anchor and joint.
void hang_door(Physics& physics, Door& door);
/// The hinge of a dynamic one out of the physics again.
void unhang_door(Physics& physics, const Door& door);

/// What of a leaf is seen and touched: its panel, and handles on both sides where it moves by itself.
std::vector<Shape> leaf_shapes(const Door& door);

/// Outline in the plane, bottom and top of a box of the model, wherever it lies.
Footprint projection(const Transform<Map, Body>& T_map_body, const Eigen::Vector3d& size, double& bottom,
                     double& top);

}  // namespace parhelion::simulation
