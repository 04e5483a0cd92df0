// A session's configuration: plain structs with working defaults, read from YAML with units and line numbers.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocols/command.hpp"
#include "protocols/driving_timing.hpp"
#include "protocols/hazard.hpp"
#include "protocols/lesson.hpp"
#include "protocols/script.hpp"
#include "protocols/status.hpp"
#include "protocols/training.hpp"
#include "protocols/zone.hpp"

namespace parhelion {

struct InjectionLimits {
  double max_error = 0.10;  ///< m, 1 sigma predicted at the agent; above it nothing is injected
  /// Share of max_error below which an agent that the limit has stopped comes back: between the two it would
  /// blink.
  double restore = 0.8;
};

struct ContactLimits {
  double slow_distance = 1.0;   ///< m, virtual contact begins to reduce TELEOP
  double stop_distance = 0.15;  ///< m, it is zero towards the body
  double crawl_speed = 0.2;     ///< m/s, after pose loss and a released dead-man
  double silence = driving_timing::teleop_silence.seconds();  ///< s without TELEOP: stop
};

/// POSE (a pose without covariance) in place of POSE_COV: how well it is known, and in which map.
struct PoseInput {
  double position_sigma = 0;  ///< m, 1 sigma of x and of y (and z)
  double yaw_sigma = 0;       ///< rad, 1 sigma (and of roll and pitch)
  std::string map_id;         ///< map that the poses are in; empty: the model's
};

/// Levels 1 and 2: the trainee's robot, simulated.
struct Trainee {
  std::string name = "trainee";     ///< letters, digits, '_' and '-'
  std::string model;                ///< a shipped robot model by name, or the path of its YAML file
  Transform<Map, Base> T_map_base;  ///< where it starts, on the floor
  bool slam = false;                ///< POSE_COV comes from outside, as at level 3; else from the simulation
};

/// What a scenario says of a door of the model.
struct DoorSettings {
  std::string name;  ///< as the model calls it
  std::optional<bool>
      is_virtual;       ///< drawn, not real: it moves by itself at level 3 too; none: as the model says
  double friction = 1;  ///< N m, of the hinge
  double closer = 0;    ///< N m that pull it shut; 0: none
  double break_impulse = 150;   ///< N s through the hinge within 20 ms that push it off; 0: nothing does
  std::optional<double> angle;  ///< rad from where it closes its opening, at the start; none: as it is drawn
  bool locked = false;          ///< does not turn
};

struct Scenario {
  std::string name;
  int level = 3;  ///< 1, 2 or 3
  std::uint64_t seed = 1;
  double physics_rate = 240;  ///< Hz
  std::string model;          ///< path of a semantic model; empty: open floor
  std::string robot;          ///< path of a robot description; empty: the ROBOT channel
  bool mapping = false;       ///< DEPTH images build the model further while the server runs
  InjectionLimits injection;
  ContactLimits contact;
  std::optional<Trainee> trainee;
  std::optional<PoseInput> pose;     ///< none: POSE is not consumed, POSE_COV is
  std::uint64_t most_agents = 1000;  ///< more are refused: what this machine can step and send in time
  double most_agent_pictures = 10;   ///< Hz, of the cameras of all agents together; more are refused
  std::vector<AgentDefinition> agents;
  std::vector<Zone> zones;
  std::vector<Script> scripts;
  std::vector<DoorSettings> doors;  ///< those of which there is something to say
  std::vector<Hazard> hazards;
  HazardSensor hazard_sensor;                   ///< of the robot that reads them
  std::optional<Radio> radio;                   ///< none: simulated robots hear their operator everywhere
  std::optional<Battery> battery;               ///< none: theirs last for ever
  std::vector<Lesson> lessons;                  ///< what goes wrong on purpose
  std::optional<Training> training;             ///< what is graded; none: nothing
  std::vector<DrawnValue> drawn;                ///< what was given as a range, and is now one value
  std::map<std::string, std::string> channels;  ///< canonical name -> name on the bus, for those that differ
};

/// Reads YAML (schema scenario.schema.json). Errors are "file:line: unknown key 'agnets', did you mean
/// 'agents'?". Paths are left as they are written. Ranges are drawn from `seed`, which takes the place of the
/// file's; none: from that.
Result<Scenario> parse_scenario(const std::string& yaml, const std::string& origin,
                                std::optional<std::uint64_t> seed = std::nullopt);
/// The same from a file; paths of model, robot and robot models are resolved against the file's folder.
Result<Scenario> load_scenario(const std::string& path, std::optional<std::uint64_t> seed = std::nullopt);
/// YAML that parse_scenario reads back to the same values.
std::string to_yaml(const Scenario& scenario);

}  // namespace parhelion
