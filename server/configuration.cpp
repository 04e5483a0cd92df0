#include "server/configuration.hpp"

#include <filesystem>

#include "protocols/channels.hpp"

namespace parhelion {
namespace {

constexpr std::string_view teleop_prefix = "MR_AGENT_";
constexpr std::string_view teleop_suffix = "_TELEOP";

}  // namespace

ChannelMap::ChannelMap(const Scenario& scenario)
    : renamed_(scenario.channels.begin(), scenario.channels.end()) {
  std::vector<std::pair<const char*, InputKind>> known = {
      {channel::robot, InputKind::robot},
      {channel::scan, InputKind::scan},
      {channel::odometry, InputKind::odometry},
      {channel::camera, InputKind::camera},
      {channel::depth, InputKind::depth},
      {channel::imu, InputKind::imu},
      {channel::teleop, InputKind::teleop},
      {channel::joint_state, InputKind::joint_state},
      {channel::joint_cmd, InputKind::joint_command},
      {channel::mr_agent_cmd, InputKind::agent_command},
      {channel::loop, InputKind::loop},
      {channel::mr_model, InputKind::model},
      {channel::pose_cov, InputKind::pose_cov},
  };
  // One word on the robot's place: POSE, where its covariance is configured, or POSE_COV.
  if (scenario.pose) known.back() = {channel::pose, InputKind::pose};
  for (const auto& [canonical, kind] : known) inputs_.push_back({canonical, kind, bus(canonical)});
}

std::string ChannelMap::bus(std::string_view canonical) const {
  for (const auto& [name, renamed] : renamed_) {
    if (name == canonical) return renamed;
  }
  return std::string(canonical);
}

InputKind ChannelMap::kind(std::string_view bus_name, std::string_view* agent) const {
  for (const Entry& entry : inputs_) {
    if (entry.bus == bus_name) return entry.kind;
  }
  if (bus_name.starts_with(teleop_prefix) && bus_name.ends_with(teleop_suffix) &&
      bus_name.size() > teleop_prefix.size() + teleop_suffix.size()) {
    if (agent != nullptr) {
      *agent = bus_name.substr(teleop_prefix.size(),
                               bus_name.size() - teleop_prefix.size() - teleop_suffix.size());
    }
    return InputKind::agent_teleop;
  }
  return InputKind::none;
}

std::vector<std::string> ChannelMap::inputs() const {
  std::vector<std::string> names;
  for (const Entry& entry : inputs_) names.push_back(entry.bus);
  names.push_back("MR_AGENT_.*_TELEOP");
  return names;
}

Status check_level(const Scenario& scenario) {
  if (scenario.level == 3) return {};
  return Error{"scenario '" + scenario.name + "': level " + std::to_string(scenario.level) +
               " is not supported yet, only level 3 (a real robot, live or recorded)"};
}

Status check_robot(const RobotDescription& robot) {
  if (!robot.laser) {
    return Error{"robot description '" + robot.name +
                 "' has no laser: level 3 injects into its scans; add a 'laser' section"};
  }
  if (robot.footprint.size() < 3) {
    return Error{"robot description '" + robot.name + "' has a footprint of " +
                 std::to_string(robot.footprint.size()) +
                 " corners: contacts need at least three; add a 'footprint'"};
  }
  return {};
}

Result<Configuration> configure(const Scenario& scenario, const RobotDescription& robot,
                                const SemanticModel& model) {
  if (const Status level = check_level(scenario); !level) return level.error();
  if (const Status usable = check_robot(robot); !usable) return usable.error();
  return Configuration{scenario, robot, model, ChannelMap(scenario)};
}

SessionHeader session_header(const Configuration& configuration, SensorTime start) {
  // Model and robot are embedded: of their paths only the names, so that no folder of this machine shows.
  Scenario scenario = configuration.scenario;
  scenario.model = std::filesystem::path(scenario.model).filename().string();
  scenario.robot = std::filesystem::path(scenario.robot).filename().string();
  SessionHeader header;
  header.stamp = start;
  header.scenario_yaml = to_yaml(scenario);
  header.model_yaml = to_yaml(configuration.model);
  header.robot_yaml = to_yaml(configuration.robot);
  header.seed = configuration.scenario.seed;
  header.version = version_text();
  header.input_channels = configuration.channels.inputs();
  return header;
}

Result<Configuration> configuration_from(const SessionHeader& header, const std::string& origin) {
  const auto scenario = parse_scenario(header.scenario_yaml, origin + " (MR_SESSION scenario)");
  if (!scenario) return scenario.error();
  const auto robot = parse_robot_description(header.robot_yaml, origin + " (MR_SESSION robot)");
  if (!robot) return robot.error();
  const auto model = parse_model(header.model_yaml, origin + " (MR_SESSION model)");
  if (!model) return model.error();
  return configure(*scenario, *robot, *model);
}

std::string version_text() {
  return std::string("parhelion ") + PARHELION_VERSION + ", " + PARHELION_LIBRARY_VERSIONS;
}

}  // namespace parhelion
