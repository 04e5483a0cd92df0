#include "server/runtime/check_hazards.hpp"

#include <algorithm>
#include <initializer_list>
#include <vector>

#include "protocols/nearest_name.hpp"
#include "protocols/yaml/document.hpp"

namespace parhelion::runtime {
namespace {

using Names = std::vector<std::string>;

constexpr const char* kAnybody = "any";  // as the subject of a condition

/// "lab.yaml:7: " of each item of the list at these keys; the first line where the file has fewer.
std::vector<std::string> places_of_items(const std::string& path, std::initializer_list<const char*> keys,
                                         std::size_t count) {
  const auto text = yaml::read_text(path);
  const auto document = text ? yaml::read_document(*text, path) : Result<yaml::Node>(text.error());
  const yaml::Node* node = document ? &*document : nullptr;
  for (const char* key : keys) {
    if (node != nullptr) node = node->find(key);
  }
  std::vector<std::string> places;
  for (std::size_t i = 0; i < count; ++i) {
    const bool found = node != nullptr && i < node->items.size();
    places.push_back(path + ":" + std::to_string(found ? node->items[i].line : 1) + ": ");
  }
  return places;
}

bool has(const Names& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

Error unknown(const std::string& what, const std::string& name, const Names& names) {
  std::string list;
  for (const std::string& each : names) list += (list.empty() ? "" : ", ") + each;
  const std::string near = suggestion(name, names);
  const std::string known = names.empty() ? "none is defined" : "there are: " + list;
  return Error{what + " '" + name + "'" + (near.empty() ? "; " + known : near + " T" + known.substr(1))};
}

/// Agents of the start, those that scripts may spawn, the simulated robot, and movable objects of the site.
Names names_of_movers(const SessionFiles& files) {
  Names names = agent_names(files.scenario);
  if (files.scenario.trainee) names.insert(names.begin(), files.scenario.trainee->name);
  for (const ModelObject& object : files.objects) names.push_back(object.name);
  return names;
}

/// An event of a dose is about its kind; one of a hazard names the hazard and what triggered it, in either
/// order. At level 3 that may be a real robot, whose name may come with its description on the bus.
Status check_event(const Condition& condition, const SessionFiles& files, const std::string& where) {
  const bool dose = condition.event == EventKind::dose_warning || condition.event == EventKind::dose_limit;
  if (dose) {
    const Names kinds{to_string(HazardKind::radiation), to_string(HazardKind::gas)};
    if (condition.object.empty() || has(kinds, condition.object)) return {};
    return unknown(where + "there is no dose of", condition.object, kinds);
  }
  if (condition.event != EventKind::hazard_triggered || !tick::simulates_trainee(files.scenario)) return {};
  Names names;
  for (const Hazard& hazard : files.scenario.hazards) names.push_back(hazard.name);
  for (std::string& name : names_of_movers(files)) names.push_back(std::move(name));
  for (const std::string& name : {condition.subject, condition.object}) {
    if (!name.empty() && name != kAnybody && name != kTrainee && !has(names, name))
      return unknown(where + "there is no hazard or agent", name, names);
  }
  return {};
}

Status check_events(const Condition& condition, const SessionFiles& files, const std::string& where) {
  if (condition.kind == Condition::Kind::event) {
    if (Status known = check_event(condition, files, where); !known) return known;
  }
  for (const auto* list : {&condition.parts, &condition.never}) {
    for (const Condition& part : *list) {
      if (Status known = check_events(part, files, where); !known) return known;
    }
  }
  return {};
}

Status check_training_events(const std::string& path, const SessionFiles& files) {
  if (!files.scenario.training) return {};
  const Training& training = *files.scenario.training;
  const auto tasks = places_of_items(path, {"training", "tasks"}, training.tasks.size());
  for (std::size_t i = 0; i < training.tasks.size(); ++i) {
    const Task& task = training.tasks[i];
    const std::string where = tasks[i] + "task '" + task.name + "': ";
    if (Status known = check_events(task.done, files, where); !known) return known;
    for (const Condition& failed : task.failed) {
      if (Status known = check_events(failed, files, where); !known) return known;
    }
  }
  const auto penalties = places_of_items(path, {"training", "penalties"}, training.penalties.size());
  for (std::size_t i = 0; i < training.penalties.size(); ++i) {
    const Penalty& penalty = training.penalties[i];
    const std::string where = penalties[i] + "penalty '" + penalty.name + "': ";
    if (Status known = check_events(penalty.when, files, where); !known) return known;
  }
  return {};
}

}  // namespace

Status check_hazards(const std::string& path, const SessionFiles& files) {
  const std::vector<Hazard>& hazards = files.scenario.hazards;
  const Names names = names_of_movers(files);
  for (std::size_t i = 0; i < hazards.size(); ++i) {
    if (hazards[i].agent.empty() || has(names, hazards[i].agent)) continue;
    return unknown(
        places_of_items(path, {"hazards"}, i + 1)[i] + "hazard '" + hazards[i].name + "': there is no agent",
        hazards[i].agent, names);
  }
  return check_training_events(path, files);
}

}  // namespace parhelion::runtime
