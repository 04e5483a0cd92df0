// Agents, how they are defined and what they do; and what operators' consoles say.
// What an instructor asks of them: instructor_command.hpp.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/time.hpp"

namespace parhelion {

enum class AgentKind : std::uint8_t {
  box,
  barrel,
  person,
  robot,
  container,  ///< a box without a lid: what is put in stays in
  cable,      ///< lies along x; links that bend at their ends
};
inline constexpr AgentKind kLastAgentKind = AgentKind::cable;

enum class BehaviourKind : std::uint8_t {
  stay,
  patrol,  ///< along `waypoints`, back to the first after the last
  wander,  ///< about without hitting things
  teleop,  ///< driven by MR_AGENT_<name>_TELEOP
  follow,  ///< goes after `target`, round what is in the way, and stays `distance` from it
  flee,    ///< keeps away from `target` when that is nearer than `distance`
  block,   ///< stands in `target`'s way, `distance` ahead of where that can stop; never nearer
  go,      ///< to each of `waypoints` in turn, round what is in the way; stays at the last
};
inline constexpr BehaviourKind kLastBehaviourKind = BehaviourKind::go;

struct Behaviour {
  BehaviourKind kind = BehaviourKind::stay;
  double speed = 0.5;                      ///< m/s
  std::vector<Eigen::Vector2d> waypoints;  ///< m, map frame
  std::string target;                      ///< an agent or the trainee's robot by name; empty: the latter
  double distance = 1.5;                   ///< m, between outlines; of follow, flee and block
  bool yields = false;                     ///< steps aside for a robot that comes at it, standing or walking
  bool opens_doors = true;  ///< pushes doors that can be pushed; false: a closed one is a wall to it
};

/// A virtual thing at its start.
struct AgentDefinition {
  std::string name;  ///< unique, letters, digits, '_' and '-': part of channel names
  AgentKind kind = AgentKind::box;
  Transform<Map, Base> T_map_base;      ///< planar: on the floor
  Eigen::Vector3d size{0.4, 0.4, 0.6};  ///< m, x, y, z; of a cable: length, diameter, diameter
  Behaviour behaviour;
  std::string laser;       ///< preset of its own simulated laser, empty: none
  std::string model;       ///< of a robot: its robot model by name; empty: the simple one that stays upright
  double camera_rate = 0;  ///< Hz, of the pictures that its robot model's camera sends; 0: none
};

/// What a console says of itself (channel OPERATOR): at each change, and again within half a second.
struct OperatorWord {
  enum class State : std::uint8_t { drives, ended, lost };
  SensorTime stamp;   ///< when it was said, the console's clock
  std::string name;   ///< of the operator
  std::string robot;  ///< that the operator drives: the trainee's, or an agent
  State state = State::drives;
  std::string text;  ///< which console, or why it was lost
};

const char* to_string(AgentKind kind);
const char* to_string(BehaviourKind kind);

}  // namespace parhelion
