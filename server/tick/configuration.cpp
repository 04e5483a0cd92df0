#include "server/tick/configuration.hpp"

#include <algorithm>
#include <cassert>

#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/scenario_robots.hpp"
#include "server/tick/robot_descriptions.hpp"
#include "server/tick/sensor_channels.hpp"

namespace parhelion::tick {
namespace {

constexpr std::string_view kAgentPrefix = "MR_AGENT_";
constexpr std::string_view kTeleopSuffix = "_TELEOP";
constexpr std::string_view kJointSuffix = "_JOINT_CMD";

Status check_map(const Scenario& scenario, const SemanticModel& model, const pose::MatchingMap* map) {
  if (map == nullptr || model.map_id.empty() || map->id == model.map_id) return {};
  return Error{"scenario '" + scenario.name + "': map " + scenario.map + " has the id " + map->id +
               ", the model is of map " + model.map_id +
               "; give the map that the model was made from, or make " + "the model again"};
}

/// What a sensor sends on one of its channels; none: the server's answer.
InputKind input_of_sensor(std::string_view canonical) {
  if (canonical == channel::kScan) return InputKind::scan;
  if (canonical == channel::kCamera) return InputKind::camera;
  return canonical == channel::kDepth ? InputKind::depth : InputKind::none;
}

/// The last part of a path.
std::string file_name(const std::string& path) { return path.substr(path.rfind('/') + 1); }

}  // namespace

ChannelMap::ChannelMap(const Scenario& scenario, const SensorNames& sensors)
    : renamed_(scenario.channels.begin(), scenario.channels.end()), robots_(robots_in_channels(scenario)) {
  std::vector<std::pair<const char*, InputKind>> known = {
      {channel::kTeleop, InputKind::teleop},       {channel::kJointCmd, InputKind::joint_command},
      {channel::kOperators, InputKind::operators}, {channel::kLoop, InputKind::loop},
      {channel::kMrModel, InputKind::model},
  };
  for (const char* canonical : kInstructorChannels) {
    const bool stop = std::string_view(canonical) == channel::kMrEmergencyStop;
    known.emplace_back(canonical, stop ? InputKind::emergency_stop : InputKind::command);
  }
  const bool simulated = simulates_trainee(scenario);
  if (!simulated) {
    known.insert(known.end(), {{channel::kRobot, InputKind::robot},
                               {channel::kScan, InputKind::scan},
                               {channel::kOdometry, InputKind::odometry},
                               {channel::kCamera, InputKind::camera},
                               {channel::kDepth, InputKind::depth},
                               {channel::kLines, InputKind::lines},
                               {channel::kImu, InputKind::imu},
                               {channel::kJointState, InputKind::joint_state}});
  }
  // Exactly one source of the robot's pose: POSE, where its covariance is configured, or POSE_COV; for a
  // simulated robot only if SLAM provides it.
  if (!simulated && scenario.pose) {
    known.push_back({channel::kPose, InputKind::pose});
  } else if (!simulated || (scenario.trainee && scenario.trainee->slam)) {
    known.push_back({channel::kPoseCov, InputKind::pose_cov});
  }
  const std::size_t robots = std::max<std::size_t>(1, robots_.size());
  for (const auto& [canonical, kind] : known) {
    const std::size_t count = is_robot_channel(canonical) ? robots : 1;
    for (std::size_t robot = 0; robot < count; ++robot)
      inputs_.push_back({canonical, kind, robot, bus(canonical, robot)});
  }
  for (const char* canonical : robot_channels()) {
    for (std::size_t robot = 0; robot < robots; ++robot)
      of_robots_.push_back({canonical, robot, bus(canonical, robot)});
  }
  for (std::size_t robot = 0; robot < std::min(robots, sensors.size()); ++robot) {
    add_sensors(robot, laser_channels(), sensors[robot].lasers, simulated);
    add_sensors(robot, camera_channels(), sensors[robot].cameras, simulated);
  }
}

void ChannelMap::add_sensors(std::size_t robot, std::span<const char* const> channels,
                             const std::vector<std::string>& names, bool simulated) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (const char* canonical : channels) {
      const std::string own = sensor_channel(canonical, names[i]);
      of_robots_.push_back({canonical, robot, bus(own, robot), i + 1});
      const InputKind input = input_of_sensor(canonical);
      if (!simulated && input != InputKind::none)
        inputs_.push_back({own, input, robot, bus(own, robot), i + 1});
    }
  }
}

std::string ChannelMap::bus(std::string_view canonical, std::size_t robot) const {
  const bool carries_name = !robots_.empty() && is_robot_channel(canonical);
  std::string whole = carries_name ? robot_channel(canonical, robots_[robot]) : std::string(canonical);
  for (const auto& [name, renamed] : renamed_) {
    if (name == whole) return renamed;
  }
  return whole;
}

const std::string& ChannelMap::robots_bus(std::string_view canonical, std::size_t robot,
                                          std::size_t sensor) const {
  const auto found = std::find_if(of_robots_.begin(), of_robots_.end(), [&](const RobotsChannel& each) {
    return each.robot == robot && each.sensor == sensor && each.canonical == canonical;
  });
  assert(found != of_robots_.end());
  return found->bus;
}

InputKind ChannelMap::kind(std::string_view bus_name, std::string_view* agent, std::size_t* robot,
                           std::size_t* sensor) const {
  if (robot != nullptr) *robot = 0;
  if (sensor != nullptr) *sensor = 0;
  for (const Entry& entry : inputs_) {
    if (entry.bus != bus_name) continue;
    if (robot != nullptr) *robot = entry.robot;
    if (sensor != nullptr) *sensor = entry.sensor;
    return entry.kind;
  }
  for (const auto& [suffix, kind] : {std::pair(kTeleopSuffix, InputKind::agent_teleop),
                                     std::pair(kJointSuffix, InputKind::agent_joint_command)}) {
    if (!bus_name.starts_with(kAgentPrefix) || !bus_name.ends_with(suffix) ||
        bus_name.size() <= kAgentPrefix.size() + suffix.size())
      continue;
    if (agent != nullptr)
      *agent = bus_name.substr(kAgentPrefix.size(), bus_name.size() - kAgentPrefix.size() - suffix.size());
    return kind;
  }
  return InputKind::none;
}

std::string_view ChannelMap::canonical(std::string_view bus_name) const {
  for (const Entry& entry : inputs_) {
    if (entry.bus == bus_name) return entry.canonical;
  }
  return {};
}

std::vector<std::string> ChannelMap::inputs() const {
  std::vector<std::string> names;
  for (const Entry& entry : inputs_) names.push_back(entry.bus);
  names.push_back("MR_AGENT_.*_TELEOP");
  names.push_back("MR_AGENT_.*_JOINT_CMD");
  return names;
}

std::optional<std::size_t> Configuration::find_robot(std::string_view name) const {
  for (std::size_t i = 0; i < robot_count(); ++i) {
    if (robot_at(i).name == name) return i;
  }
  return std::nullopt;
}

Status check_level(const Scenario& scenario) {
  const std::string who = "scenario '" + scenario.name + "': level " + std::to_string(scenario.level) + " ";
  if (!simulates_trainee(scenario)) {
    if (scenario.robots.size() > 1 && scenario.mapping)
      return Error{who + "maps with one robot: remove 'mapping', or all but one of the 'robots'"};
    if (!scenario.trainee) return {};
    return Error{who +
                 "has a real robot: 'trainee' is for levels 1 and 2; remove it, or make what the trainee "
                 "drives one of the 'agents' (kind: robot, behaviour: teleop)"};
  }
  if (!scenario.trainee || scenario.trainee->model.empty()) {
    return Error{who +
                 "needs the trainee's robot, which is simulated; add 'trainee: {model: rover, pose: {x: 0 "
                 "m, y: 0 m}}'"};
  }
  if (!scenario.robots.empty())
    return Error{who +
                 "simulates one robot, that of 'trainee': 'robots' are real ones, for level 3; remove it"};
  if (!scenario.robot.empty())
    return Error{who + "simulates the robot model given in 'trainee'; remove 'robot'"};
  if (scenario.pose)
    return Error{who + "has the exact pose of its robot; remove 'pose', or set 'slam: true' in 'trainee'"};
  if (scenario.mapping)
    return Error{who + "simulates the model: there is nothing to map; remove 'mapping', or map at level 3"};
  return {};
}

Result<RobotDescription> trainee_description(const Scenario& scenario, const RobotModels& models) {
  const Trainee& trainee = *scenario.trainee;
  std::string known;
  for (const auto& model : models) {
    if (model->name != trainee.model) {
      known += (known.empty() ? "" : ", ") + model->name;
      continue;
    }
    RobotDescription description = model->description;
    description.name = trainee.name;
    description.model.clear();
    // All rows of a camera are rendered at one instant, and simulated stamps are those of the scans' clock.
    if (description.camera) description.camera->readout = description.camera->time_offset = 0;
    for (NamedCameras& each : description.further_cameras)
      if (each.camera) each.camera->readout = each.camera->time_offset = 0;
    if (description.imu) description.imu->time_offset = 0;
    return description;
  }
  return Error{"scenario '" + scenario.name + "': no robot model '" + trainee.model +
               "' for the trainee; known: " + (known.empty() ? "none" : known)};
}

Status check_robot(const RobotDescription& robot) {
  if (!robot.laser) {
    return Error{"robot description '" + robot.name +
                 "' has no laser: its scans are what the server answers; add a 'laser' section"};
  }
  if (robot.footprint.size() < 3) {
    return Error{"robot description '" + robot.name + "' has a footprint of " +
                 std::to_string(robot.footprint.size()) +
                 " corners: contacts need at least three; add a 'footprint'"};
  }
  return {};
}

namespace {

/// What configure() returns, before further sensors have their channels.
Result<Configuration> configure_first(const Scenario& scenario, const RobotDescription& robot,
                                      const SemanticModel& model, RobotModels robot_models,
                                      std::shared_ptr<const pose::MatchingMap> map,
                                      std::vector<ModelObject> objects) {
  if (const Status level = check_level(scenario); !level) return level.error();
  if (const Status same = check_map(scenario, model, map.get()); !same) return same.error();
  Configuration configuration{scenario,      robot, model, ChannelMap(scenario), std::move(robot_models),
                              std::move(map)};
  if (simulates_trainee(scenario)) {
    auto description = trainee_description(scenario, configuration.robot_models);
    if (!description) return description.error();
    configuration.robot = std::move(*description);
    configuration.objects = std::move(objects);
  }
  if (const Status usable = check_robot(configuration.robot); !usable) return usable.error();
  return configuration;
}

/// Gives each further sensor its channels.
Result<Configuration> with_sensors(Configuration configuration) {
  const SensorNames sensors = further_sensors(configuration);
  if (const Status free = check_sensor_channels(configuration.scenario, sensors); !free) return free.error();
  if (std::any_of(sensors.begin(), sensors.end(),
                  [](const FurtherSensors& each) { return !each.lasers.empty() || !each.cameras.empty(); }))
    configuration.channels = ChannelMap(configuration.scenario, sensors);
  return configuration;
}

}  // namespace

Result<Configuration> configure(const Scenario& scenario, const RobotDescription& robot,
                                const SemanticModel& model, RobotModels robot_models,
                                std::shared_ptr<const pose::MatchingMap> map,
                                std::vector<ModelObject> objects) {
  auto configuration =
      configure_first(scenario, robot, model, std::move(robot_models), std::move(map), std::move(objects));
  if (!configuration) return configuration;
  return with_sensors(std::move(*configuration));
}

Result<Configuration> configure_robots(const Scenario& scenario, std::vector<RobotDescription> robots,
                                       const SemanticModel& model, RobotModels robot_models,
                                       std::shared_ptr<const pose::MatchingMap> map,
                                       std::vector<ModelObject> objects) {
  if (const Status named = name_robots(scenario, robots); !named) return named.error();
  auto configuration = configure_first(scenario, robots.front(), model, std::move(robot_models),
                                       std::move(map), std::move(objects));
  if (!configuration) return configuration;
  for (std::size_t i = 1; i < robots.size(); ++i) {
    if (const Status usable = check_robot(robots[i]); !usable) return usable.error();
    configuration->other_robots.push_back(std::move(robots[i]));
  }
  return with_sensors(std::move(*configuration));
}

SensorNames further_sensors(const Configuration& configuration) {
  SensorNames names(configuration.robot_count());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const RobotDescription& robot = configuration.robot_at(i);
    for (const NamedLaser& laser : robot.further_lasers) names[i].lasers.push_back(laser.name);
    for (const NamedCameras& cameras : robot.further_cameras) names[i].cameras.push_back(cameras.name);
  }
  return names;
}

std::vector<std::string> known_names(const Configuration& configuration) {
  const Scenario& scenario = configuration.scenario;
  std::vector<std::string> names{kTrainee, configuration.robot.name};
  for (const RobotDescription& robot : configuration.other_robots) names.push_back(robot.name);
  if (scenario.trainee) names.push_back(scenario.trainee->name);
  for (std::string& agent : agent_names(scenario)) names.push_back(std::move(agent));
  for (const Zone& zone : scenario.zones) names.push_back(zone.name);
  for (const Script& script : scenario.scripts) names.push_back(script.name);
  for (const ModelEntity& entity : configuration.model.entities) names.push_back(entity.name);
  for (const ModelMesh& mesh : configuration.model.meshes) names.push_back(mesh.name);
  for (const ModelObject& object : configuration.objects) names.push_back(object.name);
  return names;
}

std::vector<std::string> graded_robots(const Configuration& configuration) {
  const auto& training = configuration.scenario.training;
  if (training && !training->robot.empty()) return {training->robot};
  std::vector<std::string> names{configuration.robot.name};
  for (const RobotDescription& robot : configuration.other_robots) names.push_back(robot.name);
  return names;
}

std::string graded_robot(const Configuration& configuration) { return graded_robots(configuration).front(); }

SessionHeader session_header(const Configuration& configuration, SensorTime start) {
  // Model and robot are embedded: only their file names are kept, so that no local folder is revealed.
  Scenario scenario = configuration.scenario;
  scenario.model = file_name(scenario.model);
  scenario.map = file_name(scenario.map);
  scenario.robot = file_name(scenario.robot);
  for (ScenarioRobot& robot : scenario.robots) robot.description = file_name(robot.description);
  SessionHeader header;
  header.stamp = start;
  header.scenario_yaml = to_yaml(scenario);
  header.model_yaml = to_yaml(configuration.model) + to_yaml(ModelRemarks{configuration.objects, {}});
  header.robot_yaml = to_yaml_documents(configuration);
  if (configuration.map) header.map = configuration.map->packed;
  header.seed = configuration.scenario.seed;
  header.version = version_text();
  header.input_channels = configuration.channels.inputs();
  for (const auto& each : configuration.robot_models)
    header.robot_models.push_back({each->name, each->urdf, each->yaml});
  return header;
}

Result<Configuration> configuration_from(const SessionHeader& header, const std::string& origin) {
  const auto scenario = parse_scenario(header.scenario_yaml, origin + " (MR_SESSION scenario)");
  if (!scenario) return scenario.error();
  auto robots = parse_robot_descriptions(header.robot_yaml, origin + " (MR_SESSION robot)");
  if (!robots) return robots.error();
  const auto model = parse_model(header.model_yaml, origin + " (MR_SESSION model)");
  if (!model) return model.error();
  std::vector<ModelObject> objects;
  if (simulates_trainee(*scenario)) {
    auto remarks = parse_remarks(header.model_yaml, origin + " (MR_SESSION model)");
    if (!remarks) return remarks.error();
    objects = std::move(remarks->objects);
  }
  RobotModels robot_models;
  for (const RobotModelTexts& texts : header.robot_models) {
    auto each = simulation::parse_robot_model(texts.urdf, texts.yaml,
                                              origin + " (MR_SESSION robot model " + texts.name + ")");
    if (!each) return each.error();
    robot_models.push_back(std::make_shared<const simulation::RobotModel>(std::move(*each)));
  }
  std::shared_ptr<const pose::MatchingMap> map;
  if (!header.map.empty()) {
    auto unpacked = pose::unpack_matching_map(header.map, origin + " (MR_SESSION map)");
    if (!unpacked) return unpacked.error();
    map = std::make_shared<const pose::MatchingMap>(std::move(*unpacked));
  }
  return configure_robots(*scenario, std::move(*robots), *model, std::move(robot_models), std::move(map),
                          std::move(objects));
}

std::string version_text() {
  return std::string("parhelion ") + PARHELION_VERSION + ", " + PARHELION_LIBRARY_VERSIONS;
}

}  // namespace parhelion::tick
