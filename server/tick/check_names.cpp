#include "server/tick/check_names.hpp"

#include <algorithm>
#include <string>
#include <variant>
#include <vector>

#include "protocols/nearest_name.hpp"

namespace parhelion::tick {
namespace {

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

Status check_doors(const Configuration& configuration) {
  std::vector<std::string> doors;
  for (const ModelEntity& entity : configuration.model.entities) {
    if (entity.label == EntityLabel::door && !entity.deleted) doors.push_back(entity.name);
  }
  for (const DoorSettings& door : configuration.scenario.doors) {
    if (has(doors, door.name)) continue;
    return Error{"scenario door '" + door.name + "': the model has no door of this name" +
                 suggestion_or_known(door.name, doors)};
  }
  return {};
}

/// What moves: robots and agents, also those that scripts spawn.
std::vector<std::string> targets_of(const Configuration& configuration) {
  const Scenario& scenario = configuration.scenario;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < configuration.robot_count(); ++i)
    names.push_back(configuration.robot_at(i).name);
  if (scenario.trainee) names.push_back(scenario.trainee->name);
  for (std::string& name : agent_names(scenario)) names.push_back(std::move(name));
  for (const ModelObject& object : configuration.objects) names.push_back(object.name);
  return names;
}

Status check_target(const std::string& where, const Behaviour& behaviour,
                    const std::vector<std::string>& names) {
  const std::string& target = behaviour.target;
  if (target.empty() || has(names, target)) return {};
  return Error{where + "its target '" + target + "' is no robot and no agent" +
               suggestion_or_known(target, names)};
}

}  // namespace

Status check_names(const Configuration& configuration) {
  const Scenario& scenario = configuration.scenario;
  if (!scenario.mapping) {
    if (Status known = check_doors(configuration); !known) return known;
  }
  if (scenario.level == 3 && scenario.robot.empty() && scenario.robots.empty()) return {};
  const std::vector<std::string> names = targets_of(configuration);
  for (const AgentDefinition& agent : scenario.agents) {
    const std::string where = "scenario agent '" + agent.name + "': ";
    if (Status known = check_target(where, agent.behaviour, names); !known) return known;
  }
  for (const Script& script : scenario.scripts) {
    const std::string where = "script '" + script.name + "': ";
    for (const AgentCommand& command : script.actions) {
      const auto* spawn = std::get_if<AgentSpawn>(&command);
      const auto* behave = std::get_if<AgentBehaviour>(&command);
      if (spawn == nullptr && behave == nullptr) continue;
      const Behaviour& behaviour = spawn != nullptr ? spawn->agent.behaviour : behave->behaviour;
      if (Status known = check_target(where, behaviour, names); !known) return known;
    }
  }
  return {};
}

}  // namespace parhelion::tick
