#include "tools/validate.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <variant>

#include "fusion/pose/maps/grid_map.hpp"
#include "fusion/semantic/build_model.hpp"
#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/course.hpp"
#include "protocols/length_text.hpp"
#include "protocols/model.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "protocols/scenario_robots.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/schema.hpp"
#include "server/runtime/session_files.hpp"
#include "server/simulation/robots/robot_model.hpp"
#include "server/tick/check_limits.hpp"
#include "server/tick/check_waypoints.hpp"
#include "tools/robot/plausible_size.hpp"
#include "tools/validate_log.hpp"

namespace parhelion::tools {
namespace {

constexpr double kLevelFloor = 0.05;  ///< m: smaller distances to z = 0 do not matter

std::string count(std::size_t n, const char* one, const char* many) {
  return std::to_string(n) + ' ' + (n == 1 ? one : many);
}

/// Adds one of this name where there is none.
template <class Sensor>
void add_named(const std::string& name, std::vector<Sensor>& sensors) {
  const auto known =
      std::find_if(sensors.begin(), sensors.end(), [&](const Sensor& each) { return each.name == name; });
  if (known == sensors.end()) sensors.emplace_back().name = name;
}

/// For a scenario whose robot is defined by ROBOT: a minimal robot with the sensors that the scenario names,
/// so that everything else can be checked. `in_channels`: its name there.
RobotDescription any_robot(const Scenario& scenario, std::string_view in_channels) {
  RobotDescription robot;
  robot.laser.emplace();
  robot.footprint = {{-0.3, -0.3}, {0.3, -0.3}, {0.3, 0.3}, {-0.3, 0.3}};
  for (const auto& [canonical, renamed] : scenario.channels) {
    const auto parts = parse_robot_channel(canonical);
    if (!parts || parts->robot != in_channels) continue;
    const SensorChannel sensor = parse_sensor_channel(parts->canonical);
    if (sensor.sensor.empty()) continue;
    const auto of_lasers = laser_channels();
    if (std::find(of_lasers.begin(), of_lasers.end(), sensor.canonical) != of_lasers.end())
      add_named(std::string(sensor.sensor), robot.further_lasers);
    else
      add_named(std::string(sensor.sensor), robot.further_cameras);
  }
  return robot;
}

/// The node at these keys and indices of a document; its lines are those of errors.
const yaml::Node* find_node(const yaml::Node& document,
                            std::initializer_list<std::variant<const char*, std::size_t>> steps) {
  const yaml::Node* node = &document;
  for (const auto& step : steps) {
    if (const auto* key = std::get_if<const char*>(&step)) {
      node = node->find(*key);
    } else {
      const std::size_t index = std::get<std::size_t>(step);
      node = index < node->items.size() ? &node->items[index] : nullptr;
    }
    if (node == nullptr) return nullptr;
  }
  return node;
}

/// Waypoints that cannot be reached, and limits that are too short.
void check_paths(const tick::Configuration& configuration, const std::string& path, Validation& validation) {
  const auto text = yaml::read_text(path);
  const auto document = text ? yaml::read_document(*text, path) : Result<yaml::Node>(text.error());
  if (!document) return;
  const auto place = [&](const yaml::Node* node) {
    return path + ":" + std::to_string(node == nullptr ? 1 : node->line) + ": ";
  };
  const auto waypoints = tick::wrong_waypoints(configuration);
  if (!waypoints) return;  // reported with the start
  for (const tick::WrongWaypoint& each : *waypoints) {
    const auto* node = find_node(*document, {"agents", each.agent, "behaviour", "waypoints", each.waypoint});
    validation.errors.push_back(place(node) + each.text);
  }
  for (const tick::ShortLimit& each : tick::short_limits(configuration)) {
    const auto* node = find_node(*document, {"training", "tasks", each.task, "limit"});
    validation.notes.push_back("warning: " + place(node) + each.text);
  }
}

/// The errors that serve and replay would report.
Validation validate_scenario(const std::string& path) {
  Validation validation;
  const auto scenario = load_scenario(path);
  if (!scenario) return {"", {}, {scenario.error().message}};
  validation.summary = "scenario '" + scenario->name + "', level " + std::to_string(scenario->level) + ", " +
                       count(scenario->agents.size(), "agent", "agents");
  const auto files = runtime::load_session_files(path, "");
  if (!files) {
    validation.errors.push_back(files.error().message);
    return validation;
  }
  std::vector<RobotDescription> robots;
  const std::vector<std::string> names = robots_in_channels(files->scenario);
  for (std::size_t i = 0; i < files->robots.size(); ++i) {
    const std::string in_channels = names.empty() ? "" : names[i];
    robots.push_back(files->robots[i].value_or(any_robot(files->scenario, in_channels)));
    if (!files->robots[i])
      validation.notes.push_back("names no robot description: serve and replay use the one on channel " +
                                 robot_channel(channel::kRobot, in_channels));
  }
  const auto configuration = tick::configure_robots(files->scenario, std::move(robots), files->model,
                                                    files->robot_models, nullptr, files->objects);
  const Status begun = configuration ? runtime::check_start(*configuration, path) : configuration.error();
  if (!begun) validation.errors.push_back(begun.error().message);
  if (configuration) check_paths(*configuration, path, validation);
  if (configuration)
    if (const auto note = runtime::note_without_model(*configuration))
      validation.notes.push_back("note: " + *note);
  return validation;
}

/// Checks the course, and that each of its programmes is a graded scenario. A scenario whose model is built
/// from recordings (and is missing) is checked all the same.
Validation validate_course(const std::string& path) {
  const auto course = load_course(path);
  if (!course) return {"", {}, {course.error().message}};
  Validation validation;
  validation.summary =
      "course '" + course->name + "', " + count(course->programmes.size(), "programme", "programmes");
  for (const CourseProgramme& programme : course->programmes) {
    const auto scenario = load_scenario(programme.scenario);
    if (!scenario)
      validation.errors.push_back(scenario.error().message);
    else if (!scenario->training)
      validation.errors.push_back(programme.scenario +
                                  ":1: has no 'training', which each programme of a course needs");
  }
  return validation;
}

Validation validate_model(const std::string& path) {
  const auto model = load_model(path);
  if (!model) return {"", {}, {model.error().message}};
  Validation validation;
  validation.summary = "semantic model, " + count(model->entities.size(), "entity", "entities");
  if (!model->relations.empty())
    validation.summary += ", " + count(model->relations.size(), "relation", "relations");
  std::size_t triangles = 0;
  for (const ModelMesh& mesh : model->meshes) triangles += mesh.triangles.size();
  if (triangles > 0) validation.summary += ", " + count(triangles, "triangle", "triangles");
  const auto floor = semantic::ground_floor(*model);
  if (floor && std::abs(*floor) > kLevelFloor) {
    validation.notes.push_back(
        "warning: its ground floor is at z = " + length_text(*floor) +
        ", but poses in a map are at z = 0: robots would drive above or below it; make it "
        "with `parhelion map model --floor-to-zero`");
  }
  return validation;
}

Validation validate_robot(const std::string& path) {
  const auto robot = load_robot_description(path);
  if (!robot) return {"", {}, {robot.error().message}};
  Validation validation;
  std::string parts;
  if (robot->laser) parts += ", laser";
  for (const NamedLaser& laser : robot->further_lasers) parts += ", laser '" + laser.name + "'";
  if (robot->camera) parts += ", camera";
  for (const NamedCameras& each : robot->further_cameras) {
    if (each.camera) parts += ", camera '" + each.name + "'";
    if (each.depth) parts += ", depth camera '" + each.name + "'";
  }
  if (robot->depth) parts += ", depth camera";
  validation.summary = "robot description '" + robot->name + "'" + parts;
  const auto usable = runtime::load_usable_robot(path);
  if (!usable) validation.errors.push_back(usable.error().message);
  for (const std::string& value : implausible_values(*robot)) validation.notes.push_back("warning: " + value);
  return validation;
}

Validation validate_robot_model(const std::string& path) {
  const auto model = simulation::load_robot_model(path);
  if (!model) return {"", {}, {model.error().message}};
  Validation validation;
  validation.summary = "robot model '" + model->name + "', " + count(model->links.size(), "link", "links") +
                       ", " + count(model->drive.runners.size(), "wheel or track", "wheels and tracks");
  for (const std::string& warning : model->warnings) validation.notes.push_back("warning: " + warning);
  return validation;
}

Validation validate_preset(const std::string& path) {
  const auto laser = load_laser_preset_file(path);
  if (!laser) return {"", {}, {laser.error().message}};
  return {"laser preset, " + count(static_cast<std::size_t>(laser->beams), "beam", "beams"), {}, {}};
}

Validation validate_ros_map(const std::string& path) {
  const auto map = pose::load_ros_map(path);
  if (!map) return {"", {}, {map.error().message}};
  return {"ROS map, " + std::to_string(map->width) + " x " + std::to_string(map->height) + " cells", {}, {}};
}

}  // namespace

Validation validate_file(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored) && looks_like_log(path)) return validate_log(path);
  const auto text = yaml::read_text(path);
  if (!text) return {"", {}, {text.error().message}};
  if (const std::size_t first = text->find_first_not_of(" \t\r\n");
      text->substr(0, 3) == "\xEF\xBB\xBF<" || (first != std::string::npos && (*text)[first] == '<'))
    return {
        "",
        {},
        {path + ":1: XML, such as a URDF; expected YAML: validate the robot model whose `urdf:` names it"}};
  if (std::filesystem::path(path).extension() == ".lcm" && text->find('\0') != std::string::npos)
    return {"", {}, {path + ": is not an LCM log: no event in it"}};
  const auto document = yaml::read_document(*text, path);
  if (!document) return {"", {}, {document.error().message}};
  if (document->find("image") != nullptr && document->find("resolution") != nullptr)
    return validate_ros_map(path);
  const std::string kind = yaml::guess_schema(*document);
  if (kind == "scenario") return validate_scenario(path);
  if (kind == "model") return validate_model(path);
  if (kind == "robot") return validate_robot(path);
  if (kind == "laser") return validate_preset(path);
  if (kind == "robot_model") return validate_robot_model(path);
  if (kind == "course") return validate_course(path);
  return {
      "",
      {},
      {path + ":1: none of its keys belongs to a scenario, course, model, robot description, robot model, "
              "laser preset or ROS map"}};
}

}  // namespace parhelion::tools
