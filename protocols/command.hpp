// What an instructor asks of the agents (channel MR_AGENT_CMD).
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
  std::string laser;  ///< preset of its own simulated laser, empty: none
  std::string model;  ///< of a robot: its robot model by name; empty: the simple one that stays upright
  /// Hz, of the pictures that its robot model's camera sends; 0: none. Not on the wire: Action::camera says
  /// it of an agent that is there.
  double camera_rate = 0;
};

struct AgentCommand {
  enum class Action : std::uint8_t {
    spawn,
    move,
    remove,
    behave,
    remove_all,
    freeze,
    unfreeze,
    door,          ///< the door of this name is open so far: yaw, rad from where it closes its opening
    door_unknown,  ///< takes that word back: a real door is what the sensors say
    report,        ///< the trainee's word: the thing of this name is found; an event says so
    report_at,     ///< so too, and where it lies: x, y
    script,        ///< sets off the scenario's script of this name, whatever it waits for
    lesson,  ///< begins the lesson of this kind (protocols/lesson.hpp): x its amount (of a dead wheel 1 for
             ///< the right side, else the left), y how many seconds it lasts, 0: until it is ended
    lesson_over,  ///< ends the lessons of this kind that were begun so
    camera,       ///< the camera of the agent of this name sends x pictures a second; 0: none any more
  };
  static constexpr Action last_action = Action::camera;
  SensorTime stamp;           ///< when it was asked for, the sender's clock
  std::uint64_t request = 0;  ///< chosen by the sender; the answering event carries it
  Action action = Action::spawn;
  AgentDefinition
      agent;  ///< name (of an agent, a door, a script, a lesson) always; the rest as the action needs
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
const char* to_string(AgentCommand::Action action);

}  // namespace parhelion
