// Everything that a session is made of besides its inputs: immutable once the server runs.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/model.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "protocols/status.hpp"
#include "protocols/telemetry.hpp"
#include "server/simulation/robot_model.hpp"

namespace parhelion::tick {

/// The inputs that the tick knows.
enum class InputKind : std::uint8_t {
  none,
  robot,
  scan,
  odometry,
  pose_cov,
  pose,  ///< only where the scenario says how well it is known
  imu,
  camera,
  depth,
  lines,
  teleop,
  joint_state,
  joint_command,
  command,         ///< an instructor's; its type is its channel's
  emergency_stop,  ///< so too, and obeyed even where nothing can be written
  agent_teleop,
  loop,
  model,
  operators,  ///< who drives whom
};

/// Canonical channel names to those on the bus, both ways.
class ChannelMap {
 public:
  explicit ChannelMap(const Scenario& scenario);
  /// Name on the bus.
  std::string bus(std::string_view canonical) const;
  /// What a message on this bus channel is; for agent_teleop, `agent` is the name between MR_AGENT_ and
  /// _TELEOP.
  InputKind kind(std::string_view bus_name, std::string_view* agent = nullptr) const;
  /// Canonical name of the input that this bus channel is; empty: none, or an agent's.
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
  RobotDescription robot;  ///< at levels 1 and 2 that of the trainee's model, with the trainee's name
  SemanticModel model;
  ChannelMap channels{Scenario{}};
  RobotModels robot_models;  ///< what AgentDefinition::model and Trainee::model name
};

/// Levels 1 and 2: the robot that the trainee drives is simulated, and its sensors are outputs.
inline bool simulates_trainee(const Scenario& scenario) { return scenario.level < 3; }
/// Its description. Error: none of the models has the name; the message says which there are.
Result<RobotDescription> trainee_description(const Scenario& scenario, const RobotModels& models);

/// Whether this server can run such a scenario (levels 1 and 2 need a trainee's robot, and take nothing that
/// only a real one has), and such a robot: it needs a laser and a footprint.
Status check_level(const Scenario& scenario);
Status check_robot(const RobotDescription& robot);

/// Checks that the parts fit together, as check_level and check_robot say.
Result<Configuration> configure(const Scenario& scenario, const RobotDescription& robot,
                                const SemanticModel& model, RobotModels robot_models = {});

/// Name of the robot that is graded, the trainee's where there is no training.
std::string graded_robot(const Configuration& configuration);

/// All that an event can be about by name, but for joints, operators and channels.
std::vector<std::string> known_names(const Configuration& configuration);

/// MR_SESSION for a configuration, and back. It says nothing of where the files lie.
SessionHeader session_header(const Configuration& configuration, SensorTime start);
Result<Configuration> configuration_from(const SessionHeader& header, const std::string& origin);

/// Program and the libraries that decide output bytes.
std::string version_text();

}  // namespace parhelion::tick
