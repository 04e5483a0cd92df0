#include "server/check_training.hpp"

#include <algorithm>

#include "protocols/nearest_name.hpp"

namespace parhelion {
namespace {

Status check_names(const Configuration& configuration, const Condition& condition, const std::string& where) {
  using Kind = Condition::Kind;
  std::vector<std::string> names;
  std::string what;
  const auto learn = [&](const char* is, auto wanted) {
    what = is;
    for (const ModelEntity& entity : configuration.model.entities) {
      if (wanted(entity)) names.push_back(entity.label == EntityLabel::stairs ? entity.part_of : entity.name);
    }
  };
  if (condition.kind == Kind::reach) {
    what = "zone";
    for (const Zone& zone : configuration.scenario.zones) names.push_back(zone.name);
  } else if (condition.kind == Kind::pass) {
    learn("door", [](const ModelEntity& entity) { return entity.label == EntityLabel::door; });
  } else if (condition.kind == Kind::climb) {
    learn("flight of stairs", [](const ModelEntity& entity) { return entity.label == EntityLabel::stairs; });
  } else if (condition.kind == Kind::near || condition.kind == Kind::inspect) {
    what = "agent or part of the building";
    names = known_names(configuration);
  }
  if (!what.empty() && std::find(names.begin(), names.end(), condition.target) == names.end())
    return Error{where + ": there is no " + what + " '" + condition.target + "'" +
                 suggestion_or_known(condition.target, names)};
  if (condition.kind == Kind::inspect && !configuration.robot.camera)
    return Error{where + ": robot '" + configuration.robot.name + "' has no camera to inspect '" +
                 condition.target + "' with"};
  for (const auto* list : {&condition.parts, &condition.never}) {
    for (const Condition& part : *list) {
      if (Status known = check_names(configuration, part, where); !known) return known;
    }
  }
  return {};
}

}  // namespace

Status check_training(const Configuration& configuration) {
  if (!configuration.scenario.training || configuration.scenario.mapping) return {};
  const Training& training = *configuration.scenario.training;
  const std::vector<std::string> names = known_names(configuration);
  if (!training.robot.empty() && std::find(names.begin(), names.end(), training.robot) == names.end())
    return Error{"training: no robot '" + training.robot + "'" + suggestion_or_known(training.robot, names)};
  const auto check = [&](const Condition& condition, const std::string& where) {
    return check_names(configuration, condition, where);
  };
  for (const Task& task : training.tasks) {
    const std::string where = "task '" + task.name + "'";
    if (Status known = check(task.done, where); !known) return known;
    for (const Condition& failed : task.failed) {
      if (Status known = check(failed, where); !known) return known;
    }
  }
  for (const Penalty& penalty : training.penalties) {
    if (Status known = check(penalty.when, "penalty '" + penalty.name + "'"); !known) return known;
  }
  return {};
}

}  // namespace parhelion
