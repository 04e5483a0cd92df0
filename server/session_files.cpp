#include "server/session_files.hpp"

#include <algorithm>

#include "protocols/yaml/document.hpp"
#include "server/state.hpp"

namespace parhelion {
namespace {

/// "lab.yaml:2: ": where `key` stands in a file that has been read before, or its first line.
std::string place_of(const std::string& path, const std::string& key) {
  const auto text = yaml::read_text(path);
  const auto document = text ? yaml::read_document(*text, path) : Result<yaml::Node>(text.error());
  const yaml::Node* node = document ? document->find(key) : nullptr;
  return path + ":" + std::to_string(node == nullptr ? 1 : node->line) + ": ";
}

/// The same of the agent or the script that `message`, from make_state, is about.
std::string place_of_item(const std::string& path, const Scenario& scenario, const std::string& message) {
  const auto text = yaml::read_text(path);
  const auto document = text ? yaml::read_document(*text, path) : Result<yaml::Node>(text.error());
  const auto line = [&](const char* list, const char* what, const auto& named) {
    const yaml::Node* items = document ? document->find(list) : nullptr;
    for (std::size_t i = 0; items != nullptr && i < items->items.size() && i < named.size(); ++i) {
      if (message.starts_with(std::string(what) + " '" + named[i].name + "'")) return items->items[i].line;
    }
    return 0;
  };
  const int agent = line("agents", "scenario agent", scenario.agents);
  const int script = line("scripts", "script", scenario.scripts);
  return path + ":" + std::to_string(std::max({1, agent, script})) + ": ";
}

}  // namespace

Result<RobotDescription> load_usable_robot(const std::string& path) {
  auto robot = load_robot_description(path);
  if (!robot) return robot;
  if (const Status usable = check_robot(*robot); !usable)
    return Error{place_of(path, robot->laser ? "footprint" : "laser") + usable.error().message};
  return robot;
}

Result<SessionFiles> load_session_files(const std::string& path, const std::string& robot) {
  SessionFiles files;
  auto scenario = load_scenario(path);
  if (!scenario) return scenario.error();
  files.scenario = std::move(*scenario);
  if (const Status level = check_level(files.scenario); !level)
    return Error{place_of(path, "level") + level.error().message};
  if (!files.scenario.model.empty()) {
    auto model = load_model(files.scenario.model);
    if (!model) return model.error();
    files.model = std::move(*model);
  }
  const std::string& robot_file = robot.empty() ? files.scenario.robot : robot;
  if (robot_file.empty()) return files;
  auto usable = load_usable_robot(robot_file);
  if (!usable) return usable.error();
  files.robot = std::move(*usable);
  return files;
}

Status check_start(const Configuration& configuration, const std::string& path) {
  const auto state = make_state(configuration, ArrivalTime{});
  if (state) return {};
  const std::string& message = state.error().message;
  return Error{place_of_item(path, configuration.scenario, message) + message};
}

}  // namespace parhelion
