#include "server/station/saved_scenario.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

namespace parhelion::station {
namespace {

std::string absolute(const std::string& path) {
  return path.empty() ? path : std::filesystem::absolute(path).lexically_normal().string();
}

Status write_new(const std::string& path, const std::string& text) {
  std::FILE* file = std::fopen(path.c_str(), "wxe");
  if (file == nullptr && errno == EEXIST) return Error{path + " exists already; choose another name"};
  if (file == nullptr) return Error{path + ": " + std::strerror(errno)};
  const bool written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
  if (std::fclose(file) == 0 && written) return {};
  return Error{path + ": " + std::strerror(errno)};
}

}  // namespace

Result<SavedScenario> save_scenario(StateFeed& feed, const std::string& folder, const std::string& name) {
  if (folder.empty()) return Error{"this session cannot save scenarios: it has no folder for them"};
  std::error_code fault;
  std::filesystem::create_directories(folder, fault);
  if (fault) return Error{folder + ": " + fault.message()};
  Scenario scenario = feed.configuration().scenario;
  scenario.name = name;
  scenario.model = absolute(scenario.model);
  scenario.map = absolute(scenario.map);
  scenario.robot = absolute(scenario.robot);
  scenario.drawn_values.clear();
  scenario.agents.clear();
  SavedScenario saved;
  saved.path = (std::filesystem::path(folder) / (name + ".yaml")).string();
  for (const auto& [agent, definition] : feed.placed().all()) {
    const auto place = feed.place_of(agent);
    if (!place) continue;
    scenario.agents.push_back(definition);
    // A cable's first body is its end, not its origin: its pose is the one it was placed at.
    if (definition.kind != AgentKind::cable) {
      const Eigen::Vector3d p = place->translation();
      scenario.agents.back().T_map_base = Transform<Map, Base>::planar(p.x(), p.y(), place->yaw(), p.z());
    }
  }
  for (const std::string& agent : feed.present_agents()) {
    if (feed.placed().find(agent) == nullptr) saved.left_out.push_back(agent);
  }
  saved.agents = scenario.agents.size();
  if (const Status written = write_new(saved.path, to_yaml(scenario)); !written) return written.error();
  return saved;
}

}  // namespace parhelion::station
