// Everything that defines a session besides its inputs; immutable once the server runs.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "fusion/pose/matching_map.hpp"
#include "protocols/model.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "protocols/status.hpp"
#include "protocols/telemetry.hpp"
#include "server/simulation/robot_model.hpp"

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
  loop,
  model,
  operators,  ///< which operator drives which robot
};

/// Maps canonical channel names to those on the bus, and back.
class ChannelMap {
 public:
  explicit ChannelMap(const Scenario& scenario);
  /// Name on the bus.
  std::string bus(std::string_view canonical) const;
  /// The kind of a message on this bus channel; for agent_teleop, `agent` is the name between MR_AGENT_ and
  /// _TELEOP.
  InputKind kind(std::string_view bus_name, std::string_view* agent = nullptr) const;
  /// Canonical name of the input on this bus channel; empty: not an input, or an agent's.
  std::string_view canonical(std::string_view bus_name) const;
  /// Bus names to subscribe to; the last is a pattern (agents' teleop).
  std::vector<std::string> inputs() const;

 private:
  struct Entry {
    const char* canonical;
    InputKind kind;
    std::string bus;
  };
  std::vector<Entry> inputs_;
  std::vector<std::pair<std::string, std::string>> renamed_;
};

using RobotModels = std::vector<std::shared_ptr<const simulation::RobotModel>>;

struct Configuration {
  Scenario scenario;
  RobotDescription robot;  ///< at levels 1 and 2 the trainee's robot model, with the trainee's name
  SemanticModel model;
  ChannelMap channels{Scenario{}};
  RobotModels robot_models;  ///< those that AgentDefinition::model and Trainee::model name
  std::shared_ptr<const pose::MatchingMap> map = nullptr;  ///< null: scans are not matched
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
                                std::shared_ptr<const pose::MatchingMap> map = nullptr);

/// Name of the robot that is graded; without a training the trainee's.
std::string graded_robot(const Configuration& configuration);

/// All names that an event can refer to, except joints, operators and channels.
std::vector<std::string> known_names(const Configuration& configuration);

/// Converts a configuration to MR_SESSION, and back. File locations are not included.
SessionHeader session_header(const Configuration& configuration, SensorTime start);
Result<Configuration> configuration_from(const SessionHeader& header, const std::string& origin);

/// Versions of the program and of the libraries that determine output bytes.
std::string version_text();

}  // namespace parhelion::tick
