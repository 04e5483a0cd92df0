// What agents are made of: visible parts, the shape that collides, and where the parts are as the agent
// moves.
#pragma once

#include <vector>

#include "protocols/command.hpp"
#include "protocols/scene.hpp"
#include "protocols/status.hpp"
#include "server/simulation/planar.hpp"
#include "server/simulation/robot_model.hpp"

namespace parhelion::simulation {

/// How an agent takes part in the physics; origin on the floor, between wheels or feet.
struct AgentForm {
  ShapeKind shape = ShapeKind::box;  ///< box or upright cylinder
  Eigen::Vector3d size;              ///< m, full lengths
  double mass = 10;                  ///< kg
  bool upright = false;              ///< driven, stays upright; otherwise free
  Footprint footprint;               ///< in its own frame
  std::vector<Shape> pieces = {};    ///< boxes that collide in the place of `shape`; mostly none
};

constexpr double kContainerWall = 0.015;  ///< m, of its bottom and sides

AgentForm agent_form(const AgentDefinition& agent);
/// Of an articulated robot: its footprint and height.
AgentForm robot_form(const RobotModel& model);

/// Error where the sizes make no body (not finite, not positive, a barrel that is not round).
Status check_size(const AgentDefinition& agent);

/// Moving parts of an agent that drives or walks.
struct PartMotion {
  double wheel_left = 0;      ///< rad, turned since its spawn
  double wheel_right = 0;     ///< rad
  double gait_phase = 0;      ///< rad, one turn is two steps; a function of the distance walked
  double gait_amplitude = 0;  ///< 0 stands .. 1 walks
};

/// Appends T_base_part of each body of agent_bodies(), in its order: turned about the base's y axis only.
void part_poses(const AgentDefinition& agent, const PartMotion& motion,
                std::vector<Transform<Base, Body>>& poses);

/// A footprint's outline as thin boxes, their outer sides on its edges: exact for a laser, whatever the
/// polygon. In the frame of the footprint; `height`: m.
std::vector<Shape> outline_shapes(const std::vector<Eigen::Vector2d>& footprint, double height);

struct DriveGeometry {
  double wheel_radius;  ///< m
  double track;         ///< m, between the wheels
};
inline constexpr DriveGeometry kRobotDrive{0.11, 0.42};

/// m walked in one turn of the gait's phase (two steps), at `speed` m/s.
double stride_length(double speed);

/// Where an agent robot carries its laser.
Transform<Base, Laser> agent_laser_mount();

}  // namespace parhelion::simulation
