// A session's configuration: plain structs with working defaults, read from YAML with units and line numbers.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocols/agent.hpp"
#include "protocols/driving_timing.hpp"
#include "protocols/fault.hpp"
#include "protocols/hazard.hpp"
#include "protocols/script.hpp"
#include "protocols/status.hpp"
#include "protocols/training.hpp"
#include "protocols/zone.hpp"

namespace parhelion {

struct InjectionLimits {
  double max_error = 0.10;  ///< m, 1 sigma predicted at the agent; above it injection stops
  /// Fraction of max_error below which a hidden agent is shown again; hysteresis against flicker.
  double restore = 0.8;
};

struct ContactLimits {
  double slow_distance = 1.0;   ///< m, distance at which virtual contact begins to limit TELEOP
  double stop_distance = 0.15;  ///< m, distance at which motion towards the body is zero
  double crawl_speed = 0.2;     ///< m/s, after loss of the pose and a released dead-man
  double silence = driving_timing::kTeleopSilence.seconds();  ///< s without TELEOP: stop
};

/// POSE (a pose without covariance) instead of POSE_COV: its uncertainty and its map.
struct PoseInput {
  double position_sigma = 0;  ///< m, 1 sigma of x and of y (and z)
  double yaw_sigma = 0;       ///< rad, 1 sigma (and of roll and pitch)
  std::string map_id;         ///< map of the poses; empty: the model's
};

/// Levels 1 and 2: the trainee's robot, simulated.
struct Trainee {
  std::string name = "trainee";     ///< letters, digits, '_' and '-'
  std::string model;                ///< a shipped robot model by name, or the path of its YAML file
  Transform<Map, Base> T_map_base;  ///< its start, on the floor
  bool slam = false;  ///< POSE_COV is received, as at level 3; else it comes from the simulation
};

/// One of the real robots of a session. If there are several, each has its own channels: robot_channel().
struct ScenarioRobot {
  std::string name;         ///< unique among robots and agents; replaces the name in its description
  std::string description;  ///< path of its robot description; empty: its ROBOT channel
};

/// A scenario's settings of a door of the model.
struct DoorSettings {
  std::string name;                ///< its name in the model
  std::optional<bool> is_virtual;  ///< drawn, not real: simulated at level 3 too; none: as in the model
  double friction = 1;             ///< N m, of the hinge
  double closer = 0;               ///< N m that close it; 0: none
  double break_impulse = 150;   ///< N s through the hinge within 20 ms that push it off; 0: it never breaks
  std::optional<double> angle;  ///< rad from its closed position, at the start; none: as drawn
  bool locked = false;          ///< does not turn
};

struct Scenario {
  std::string name;
  int level = 3;  ///< 1, 2 or 3
  std::uint64_t seed = 1;
  double physics_rate = 240;  ///< Hz
  std::string model;          ///< path of a semantic model; empty: open floor
  std::string map;            ///< path of the map that SLAM localizes in; empty: scans are not matched
  bool scan_matching = true;  ///< scans are matched to the map, if there is one
  std::string robot;          ///< path of a robot description; empty: the ROBOT channel
  std::vector<ScenarioRobot> robots;  ///< level 3, instead of `robot`; empty: there is one robot
  bool authentication =
      false;  ///< the server starts only with keys, and refuses messages without a signature
  /// IPv4 addresses of other machines whose messages are accepted without keys; see OtherHosts.
  std::vector<std::string> hosts;
  bool mapping = false;  ///< DEPTH images extend the model while the server runs
  InjectionLimits injection;
  ContactLimits contact;
  std::optional<Trainee> trainee;
  std::optional<PoseInput> pose;     ///< none: POSE is not consumed, POSE_COV is
  std::uint64_t max_agents = 1000;   ///< limit of what this machine can simulate; more are rejected
  double max_agent_image_rate = 10;  ///< Hz, of the cameras of all agents together; more are rejected
  std::vector<AgentDefinition> agents;
  std::vector<Zone> zones;
  std::vector<std::string> shown;  ///< agents and zones that trainees are shown from the start
  std::vector<Script> scripts;
  std::vector<DoorSettings> doors;  ///< doors with settings
  std::vector<Hazard> hazards;
  HazardSensor hazard_sensor;                   ///< of the graded robot
  DoseLimits dose_limits;                       ///< of each robot
  std::optional<Radio> radio;                   ///< none: simulated robots have unlimited radio range
  std::optional<Battery> battery;               ///< none: unlimited
  std::vector<Fault> faults;                    ///< faults injected for training
  std::optional<Training> training;             ///< tasks and grading; none: no grading
  std::vector<DrawnValue> drawn_values;         ///< values that were given as ranges
  std::map<std::string, std::string> channels;  ///< canonical name -> name on the bus, for those that differ
};

/// Agents of the start, then those that scripts may spawn.
std::vector<std::string> agent_names(const Scenario& scenario);

/// Reads YAML (schema scenario.schema.json). Errors are "file:line: unknown key 'agnets', did you mean
/// 'agents'?". Paths are kept as written. Ranges are drawn from `seed`, which replaces the file's; none: from
/// the file's.
Result<Scenario> parse_scenario(const std::string& yaml, const std::string& origin,
                                std::optional<std::uint64_t> seed = std::nullopt);
/// The same from a file; paths of model, robot and robot models are resolved against the file's folder.
Result<Scenario> load_scenario(const std::string& path, std::optional<std::uint64_t> seed = std::nullopt);
/// YAML that parse_scenario reads back to the same values.
std::string to_yaml(const Scenario& scenario);

}  // namespace parhelion
