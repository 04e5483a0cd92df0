#include "server/tick/check_training.hpp"

#include <algorithm>

#include "protocols/nearest_name.hpp"

namespace parhelion::tick {
namespace {

/// Whether the event's object is a name of the site or of an agent, not a joint, channel or task.
bool is_about_things(EventKind kind) {
  switch (kind) {
    case EventKind::contact_started:
    case EventKind::contact_continues:
    case EventKind::contact_ended:
    case EventKind::collision_predicted:
    case EventKind::near_miss:
    case EventKind::agent_hidden:
    case EventKind::agent_shown:
    case EventKind::door_opened:
    case EventKind::door_closed:
    case EventKind::door_unhinged:
    case EventKind::door_space_entered:
    case EventKind::door_space_left:
    case EventKind::gripped:
    case EventKind::lifted:
    case EventKind::dropped:
    case EventKind::placed:
    case EventKind::zone_entered:
    case EventKind::zone_left:
      return true;
    default:
      return false;
  }
}

/// near_miss has two kinds of values, distinguished by its text.
Status check_near_miss(const Condition& condition, const std::string& where) {
  if (condition.event != EventKind::near_miss) return {};
  const bool limits = condition.min || condition.max;
  if (condition.text == "gap" || condition.text == "time" || (condition.text.empty() && !limits)) return {};
  if (condition.text.empty())
    return Error{where +
                 ": near_miss has values in m and in s: add 'text: gap' or 'text: time' beside the limit"};
  return Error{where + ": near_miss has the text 'gap' or 'time', not '" + condition.text + "'"};
}

Status check_event(const Configuration& configuration, const Condition& condition, const std::string& where) {
  if (condition.kind != Condition::Kind::event) return {};
  if (Status checked = check_near_miss(condition, where); !checked) return checked;
  if (condition.object.empty() || !is_about_things(condition.event)) return {};
  const std::vector<std::string> names = known_names(configuration);
  if (std::find(names.begin(), names.end(), condition.object) != names.end()) return {};
  return Error{where + ": " + to_string(condition.event) + " of '" + condition.object +
               "' can never occur: there is nothing of that name" +
               suggestion_or_known(condition.object, names)};
}

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
  } else if (condition.kind == Kind::near || condition.kind == Kind::inspect ||
             condition.kind == Kind::avoid || condition.kind == Kind::report) {
    what = "agent or part of the building";
    names = known_names(configuration);
  } else if (condition.kind == Kind::follow || condition.kind == Kind::grip || condition.kind == Kind::lift ||
             condition.kind == Kind::place) {
    what = "agent";
    names = agent_names(configuration.scenario);
  }
  if (!what.empty() && std::find(names.begin(), names.end(), condition.target) == names.end())
    return Error{where + ": there is no " + what + " '" + condition.target + "'" +
                 suggestion_or_known(condition.target, names)};
  if (!condition.into.empty()) {
    const std::vector<std::string> agents = agent_names(configuration.scenario);
    if (std::find(agents.begin(), agents.end(), condition.into) == agents.end())
      return Error{where + ": there is no container '" + condition.into + "'" +
                   suggestion_or_known(condition.into, agents)};
  }
  if (Status known = check_event(configuration, condition, where); !known) return known;
  for (std::size_t i = 0; i < configuration.robot_count(); ++i) {
    if (condition.kind == Kind::inspect && !configuration.robot_at(i).camera)
      return Error{where + ": robot '" + configuration.robot_at(i).name + "' has no camera to inspect '" +
                   condition.target + "' with"};
  }
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

}  // namespace parhelion::tick
