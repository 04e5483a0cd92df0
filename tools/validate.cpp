#include "tools/validate.hpp"

#include <filesystem>

#include "fusion/pose/slam.hpp"
#include "protocols/model.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/schema.hpp"
#include "tools/validate_log.hpp"

namespace parhelion {
namespace {

std::string count(std::size_t n, const char* one, const char* many) {
  return std::to_string(n) + ' ' + (n == 1 ? one : many);
}

/// Errors of a file that another one names say so.
void add_named(const std::string& by, const Error& error, Verdict& verdict) {
  verdict.errors.push_back(error.message + " (named by " + by + ")");
}

Verdict validate_scenario(const std::string& path) {
  Verdict verdict;
  const auto scenario = load_scenario(path);
  if (!scenario) return {"", {}, {scenario.error().message}};
  verdict.summary = "scenario '" + scenario->name + "', level " + std::to_string(scenario->level) + ", " +
                    count(scenario->agents.size(), "agent", "agents");
  if (!scenario->model.empty()) {
    const auto model = load_model(scenario->model);
    if (!model) add_named(path, model.error(), verdict);
  }
  if (!scenario->robot.empty()) {
    const auto robot = load_robot_description(scenario->robot);
    if (!robot) add_named(path, robot.error(), verdict);
  }
  for (const AgentDefinition& agent : scenario->agents) {
    if (agent.laser.empty()) continue;
    const auto laser = load_laser_preset(agent.laser);
    if (!laser) verdict.errors.push_back(path + ": agent '" + agent.name + "': " + laser.error().message);
  }
  return verdict;
}

Verdict validate_model(const std::string& path) {
  const auto model = load_model(path);
  if (!model) return {"", {}, {model.error().message}};
  return {"semantic model, " + count(model->entities.size(), "entity", "entities"), {}, {}};
}

Verdict validate_robot(const std::string& path) {
  const auto robot = load_robot_description(path);
  if (!robot) return {"", {}, {robot.error().message}};
  std::string parts;
  if (robot->laser) parts += ", laser";
  if (robot->camera) parts += ", camera";
  if (robot->depth) parts += ", depth camera";
  return {"robot description '" + robot->name + "'" + parts, {}, {}};
}

Verdict validate_preset(const std::string& path) {
  const auto laser = load_laser_preset_file(path);
  if (!laser) return {"", {}, {laser.error().message}};
  return {"laser preset, " + count(static_cast<std::size_t>(laser->beams), "beam", "beams"), {}, {}};
}

Verdict validate_ros_map(const std::string& path) {
  const auto map = load_ros_map(path);
  if (!map) return {"", {}, {map.error().message}};
  return {"ROS map, " + std::to_string(map->width) + " x " + std::to_string(map->height) + " cells", {}, {}};
}

}  // namespace

Verdict validate_file(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored) && looks_like_log(path)) return validate_log(path);
  const auto text = yaml::read_text(path);
  if (!text) return {"", {}, {text.error().message}};
  const auto document = yaml::read_document(*text, path);
  if (!document) return {"", {}, {document.error().message}};
  if (document->find("image") != nullptr && document->find("resolution") != nullptr)
    return validate_ros_map(path);
  const std::string kind = yaml::guess_schema(*document);
  if (kind == "scenario") return validate_scenario(path);
  if (kind == "model") return validate_model(path);
  if (kind == "robot") return validate_robot(path);
  if (kind == "laser") return validate_preset(path);
  return {"",
          {},
          {path +
           ":1: none of its keys belongs to a scenario, model, robot description, laser preset or ROS map"}};
}

}  // namespace parhelion
