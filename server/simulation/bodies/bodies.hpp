// Bodies of agents: visible parts, the collision shape, and the poses of the parts in motion.
#pragma once

#include <vector>

#include "protocols/agent.hpp"
#include "protocols/scene.hpp"
#include "protocols/status.hpp"
#include "server/simulation/building/planar.hpp"
#include "server/simulation/robots/robot_model.hpp"

namespace parhelion::simulation {

/// Form of an agent in the physics; origin on the floor, between wheels or feet.
struct AgentForm {
  ShapeKind shape = ShapeKind::box;  ///< box or upright cylinder
  Eigen::Vector3d size;              ///< m, full lengths
  double mass = 10;                  ///< kg
  bool upright = false;              ///< driven, stays upright; otherwise free
  Footprint footprint;               ///< in the agent's frame
  std::vector<Shape> pieces = {};    ///< boxes that collide instead of `shape`; usually none
};

constexpr double kContainerWall = 0.015;  ///< m, of its bottom and sides

AgentForm agent_form(const AgentDefinition& agent);
/// Form of an articulated robot: its footprint and height.
AgentForm robot_form(const RobotModel& model);

/// Error: invalid sizes (not finite, not positive, a barrel that is not round).
Status check_size(const AgentDefinition& agent);

/// The bodies of an agent in its own frame: visible to lasers and cameras.
std::vector<BodyDefinition> agent_bodies(const AgentDefinition& agent, BodyId first_id);

/// Moving parts of a driving or walking agent.
struct PartMotion {
  double wheel_left = 0;      ///< rad, turned since its spawn
  double wheel_right = 0;     ///< rad
  double gait_phase = 0;      ///< rad, one cycle is two steps; a function of the distance walked
  double gait_amplitude = 0;  ///< 0 standing .. 1 walking
};

/// Appends T_base_part of each body of agent_bodies(), in its order: turned about the base's y axis only.
void part_poses(const AgentDefinition& agent, const PartMotion& motion,
                std::vector<Transform<Base, Body>>& poses);

/// A footprint's outline as thin boxes with their outer sides on its edges: exact for a laser with any
/// polygon. In the frame of the footprint; `height`: m.
std::vector<Shape> outline_shapes(const std::vector<Eigen::Vector2d>& footprint, double height);

struct DriveGeometry {
  double wheel_radius;  ///< m
  double track;         ///< m, between the wheels
};
inline constexpr DriveGeometry kRobotDrive{0.11, 0.42};

/// m walked per gait cycle (two steps), at `speed` m/s.
double stride_length(double speed);

/// Mount of an agent robot's laser.
Transform<Base, Laser> agent_laser_mount();

}  // namespace parhelion::simulation
