// Agents: their definitions and behaviours. For an instructor's commands to them see instructor_command.hpp.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "protocols/frames.hpp"

namespace parhelion {

enum class AgentKind : std::uint8_t {
  box,
  barrel,
  person,
  robot,
  container,  ///< a box without a lid: objects placed in it stay in
  cable,      ///< lies along x; links that bend at their ends
};
inline constexpr AgentKind kLastAgentKind = AgentKind::cable;

enum class BehaviourKind : std::uint8_t {
  stay,
  patrol,  ///< along `waypoints`, returning to the first after the last
  wander,  ///< moves about, avoiding obstacles
  teleop,  ///< driven by MR_AGENT_<name>_TELEOP
  follow,  ///< goes to `target` around obstacles and stays `distance` from it
  flee,    ///< moves away from `target` when that is nearer than `distance`
  block,   ///< blocks `target`'s path, `distance` ahead of its stopping point; never nearer
  go,      ///< to each of `waypoints` in turn, around obstacles; stays at the last
};
inline constexpr BehaviourKind kLastBehaviourKind = BehaviourKind::go;

struct Behaviour {
  BehaviourKind kind = BehaviourKind::stay;
  double speed = 0.5;                      ///< m/s
  std::vector<Eigen::Vector2d> waypoints;  ///< m, map frame
  std::string target;                      ///< an agent or the trainee's robot by name; empty: the latter
  double distance = 1.5;                   ///< m, between outlines; of follow, flee and block
  bool yields = false;                     ///< steps aside for an approaching robot, whether idle or walking
  bool opens_doors = true;  ///< pushes doors that can be pushed; false: treats closed ones as walls
};

/// A virtual object at its start.
struct AgentDefinition {
  std::string name;  ///< unique, see agent_name_fault(): part of channel names
  AgentKind kind = AgentKind::box;
  Transform<Map, Base> T_map_base;      ///< planar: on the floor
  Eigen::Vector3d size{0.4, 0.4, 0.6};  ///< m, x, y, z; of a cable: length, diameter, diameter
  Behaviour behaviour;
  std::string laser;       ///< preset of its own simulated laser; empty: none
  std::string model;       ///< of a robot: name of its robot model; empty: the simple one that stays upright
  double camera_rate = 0;  ///< Hz, picture rate of its robot model's camera; 0: none
  double mass = 0;         ///< kg, of a box, barrel or container; 0: from the density of its kind
};

const char* to_string(AgentKind kind);
const char* to_string(BehaviourKind kind);

}  // namespace parhelion
