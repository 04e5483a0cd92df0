// Everything that defines a session besides its inputs; immutable once the server runs.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fusion/pose/maps/matching_map.hpp"
#include "protocols/model.hpp"
#include "protocols/model_objects.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "protocols/status.hpp"
#include "protocols/telemetry.hpp"
#include "server/simulation/robots/robot_model.hpp"

namespace parhelion::tick {

/// The inputs that the tick handles.
enum class InputKind : std::uint8_t {
  none,
  robot,
  scan,
  odometry,
  pose_cov,
  pose,  ///< only where the scenario gives its covariance
  imu,
  camera,
  depth,
  lines,
  teleop,
  joint_state,
  joint_command,
  command,         ///< an instructor's; its channel determines its type
  emergency_stop,  ///< also a command; applied even where the log cannot be written
  agent_teleop,
  agent_joint_command,
  loop,
  model,
  operators,  ///< which operator drives which robot
};

/// Names of a robot's sensors after the first of each kind.
struct FurtherSensors {
  std::vector<std::string> lasers, cameras;
};
using SensorNames = std::vector<FurtherSensors>;  ///< by robot

/// Maps canonical channel names to those on the bus, and back. Of several robots each has its own channels; a
/// robot is given by its index in the session, and canonical names are bare. So has each of a robot's lasers
/// and cameras, given by its index in the robot (RobotDescription::laser_at(), camera_at()).
class ChannelMap {
 public:
  explicit ChannelMap(const Scenario& scenario, const SensorNames& sensors = {});
  /// Name on the bus. `robot`: counts for channels of which each robot has its own.
  std::string bus(std::string_view canonical, std::size_t robot = 0) const;
  /// The same for a channel of which each robot has its own, without allocation; valid as long as this.
  /// `sensor`: counts for channels of which each laser or each camera has its own.
  const std::string& robots_bus(std::string_view canonical, std::size_t robot, std::size_t sensor = 0) const;
  /// The kind of a message on this bus channel; for those of agents, `agent` is the name between MR_AGENT_
  /// and _TELEOP or _JOINT_CMD; `robot`: the one whose channel it is, 0 for the session's channels; `sensor`:
  /// the laser or camera of that robot whose scans or images it has.
  InputKind kind(std::string_view bus_name, std::string_view* agent = nullptr, std::size_t* robot = nullptr,
                 std::size_t* sensor = nullptr) const;
  /// Canonical name of the input on this bus channel; empty: not an input, or an agent's.
  std::string_view canonical(std::string_view bus_name) const;
  /// Bus names to subscribe to; the last two are patterns (of agents).
  std::vector<std::string> inputs() const;

 private:
  struct Entry {
    std::string canonical;
    InputKind kind;
    std::size_t robot;
    std::string bus;
    std::size_t sensor = 0;
  };
  struct RobotsChannel {
    std::string_view canonical;  ///< a constant of protocols/channels.hpp
    std::size_t robot;
    std::string bus;
    std::size_t sensor = 0;
  };
  void add_sensors(std::size_t robot, std::span<const char* const> channels,
                   const std::vector<std::string>& names, bool simulated);
  std::vector<Entry> inputs_;
  std::vector<RobotsChannel> of_robots_;
  std::vector<std::pair<std::string, std::string>> renamed_;
  std::vector<std::string> robots_;  ///< names in channels; empty: there is one robot
};

using RobotModels = std::vector<std::shared_ptr<const simulation::RobotModel>>;

struct Configuration {
  Scenario scenario;
  /// The first robot, of most sessions the only one; at levels 1 and 2 the trainee's robot model, with the
  /// trainee's name.
  RobotDescription robot;
  SemanticModel model;
  ChannelMap channels{Scenario{}};
  RobotModels robot_models;  ///< those that AgentDefinition::model and Trainee::model name
  std::shared_ptr<const pose::MatchingMap> map = nullptr;  ///< null: scans are not matched
  std::vector<RobotDescription> other_robots = {};         ///< Scenario::robots after the first
  /// Movable objects of the site that are free bodies (simulation::take_movable()); at level 3 none.
  std::vector<ModelObject> objects = {};

  std::size_t robot_count() const { return 1 + other_robots.size(); }
  const RobotDescription& robot_at(std::size_t index) const {
    return index == 0 ? robot : other_robots[index - 1];
  }
  /// The index of the robot of this name; nullopt: an agent's name, or none.
  std::optional<std::size_t> find_robot(std::string_view name) const;
};

/// Levels 1 and 2: the trainee's robot is simulated, and its sensors are outputs.
inline bool simulates_trainee(const Scenario& scenario) { return scenario.level < 3; }
/// Description of the trainee's simulated robot. Error: no model has that name; the message lists the known
/// ones.
Result<RobotDescription> trainee_description(const Scenario& scenario, const RobotModels& models);

/// Checks that this server can run the scenario and the robot: levels 1 and 2 need a trainee's robot and
/// accept no setting of a real one; the robot needs a laser and a footprint.
Status check_level(const Scenario& scenario);
Status check_robot(const RobotDescription& robot);

/// Checks the parts with check_level and check_robot, and that the map is the one that the model is of.
Result<Configuration> configure(const Scenario& scenario, const RobotDescription& robot,
                                const SemanticModel& model, RobotModels robot_models = {},
                                std::shared_ptr<const pose::MatchingMap> map = nullptr,
                                std::vector<ModelObject> objects = {});

/// The same for all robots of the scenario, in its order. Their names in the scenario replace those of the
/// descriptions.
Result<Configuration> configure_robots(const Scenario& scenario, std::vector<RobotDescription> robots,
                                       const SemanticModel& model, RobotModels robot_models = {},
                                       std::shared_ptr<const pose::MatchingMap> map = nullptr,
                                       std::vector<ModelObject> objects = {});

/// Names of each robot's sensors after the first.
SensorNames further_sensors(const Configuration& configuration);

/// Names of the robots that are graded, each by itself: the one that the training names, or all of the
/// session; without a training those that would be.
std::vector<std::string> graded_robots(const Configuration& configuration);
/// The first of them.
std::string graded_robot(const Configuration& configuration);

/// All names that an event can refer to, except joints, sensors, operators and channels.
std::vector<std::string> known_names(const Configuration& configuration);

/// Converts a configuration to MR_SESSION, and back. File locations are not included.
SessionHeader session_header(const Configuration& configuration, SensorTime start);
Result<Configuration> configuration_from(const SessionHeader& header, const std::string& origin);

/// Versions of the program and of the libraries that determine output bytes.
std::string version_text();

}  // namespace parhelion::tick
