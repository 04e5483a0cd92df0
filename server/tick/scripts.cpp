#include "server/tick/scripts.hpp"

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>

#include "protocols/nearest_name.hpp"
#include "protocols/yaml/schema.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::tick {

using Kind = ScriptTrigger::Kind;

Scripts::Scripts(std::vector<Script> scripts, std::vector<std::string> trainees, SimulationTime start)
    : scripts_(std::move(scripts)), trainees_(std::move(trainees)), progress_(scripts_.size()) {
  begin(start);
}

void Scripts::begin(SimulationTime start) {
  for (std::size_t i = 0; i < scripts_.size(); ++i)
    progress_[i].next = start + seconds(scripts_[i].when.time);
}

bool Scripts::is(const std::string& wanted, const std::string& name) const {
  if (wanted.empty() || wanted == name) return true;
  return wanted == kTrainee && std::find(trainees_.begin(), trainees_.end(), name) != trainees_.end();
}

void Scripts::trigger(std::size_t script, SimulationTime at, const std::string& by) {
  Progress& progress = progress_[script];
  if (progress.spent) return;
  progress.spent = !scripts_[script].repeat;
  const SimulationTime due = at + seconds(scripts_[script].after);
  const auto place = std::lower_bound(
      pending_.begin(), pending_.end(), std::tie(due, script),
      [](const Pending& pending, const auto& key) { return std::tie(pending.at, pending.script) < key; });
  if (place != pending_.end() && place->at == due && place->script == script) return;
  pending_.insert(place, {due, script, by});
}

Status Scripts::trigger(const std::string& name, SimulationTime now) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < scripts_.size(); ++i) {
    names.push_back(scripts_[i].name);
    if (scripts_[i].name != name) continue;
    progress_[i].spent = false;
    trigger(i, now, {});
    return {};
  }
  if (names.empty()) return Error{"no script '" + name + "': the scenario has none"};
  return Error{"no script '" + name + "'" + suggestion_or_known(name, names)};
}

void Scripts::handle(const Event& event) {
  for (std::size_t i = 0; i < scripts_.size(); ++i) {
    const ScriptTrigger& when = scripts_[i].when;
    if (when.kind == Kind::event && when.event == event.kind && is(when.subject, event.subject) &&
        is(when.object, event.object))
      trigger(i, event.stamp, event.subject);
  }
}

void Scripts::update(SimulationTime now, const PlaceOf& place_of) {
  for (std::size_t i = 0; i < scripts_.size(); ++i) {
    const Script& script = scripts_[i];
    if (script.when.kind == Kind::near) update_near(i, now, place_of);
    if (script.when.kind != Kind::time || progress_[i].spent || now < progress_[i].next) continue;
    trigger(i, progress_[i].next, {});
    // Missed periods are not repeated.
    while (script.repeat && progress_[i].next <= now)
      progress_[i].next = progress_[i].next + seconds(script.when.time);
  }
}

void Scripts::update_near(std::size_t script, SimulationTime now, const PlaceOf& place_of) {
  const ScriptTrigger& when = scripts_[script].when;
  bool& near = progress_[script].near;
  const auto a = place_of(when.subject), b = place_of(when.object);
  const bool both = a && b;
  const double distance = both ? (*a - *b).head<2>().norm() : 0;
  const bool was = std::exchange(near, both && distance <= when.distance + (near ? kApart : 0));
  if (near && !was) trigger(script, now, when.subject);
}

std::vector<Scripts::Due> Scripts::take_due(SimulationTime now) {
  std::vector<Due> due;
  auto end = pending_.begin();
  for (; end != pending_.end() && end->at <= now; ++end)
    due.push_back({&scripts_[end->script], std::move(end->triggered_by)});
  pending_.erase(pending_.begin(), end);
  return due;
}

namespace {

bool names_things(EventKind kind) {
  switch (kind) {
    case EventKind::joint_broken:
    case EventKind::joint_overload:
    case EventKind::joint_limited:
    case EventKind::joint_limit_lifted:
    case EventKind::operator_switched:
    case EventKind::console_lost:
    case EventKind::foreign_publisher:
      return false;
    default:
      return true;
  }
}

}  // namespace

Status check_scripts(const Configuration& configuration) {
  const Scenario& scenario = configuration.scenario;
  if (scenario.scripts.empty() || scenario.mapping) return {};  // a growing map adds new names
  const std::vector<std::string> names = known_names(configuration);
  for (const Script& script : scenario.scripts) {
    if (script.when.kind == Kind::event && !names_things(script.when.event)) continue;
    for (const std::string& name : {script.when.subject, script.when.object}) {
      if (name.empty() || std::find(names.begin(), names.end(), name) != names.end()) continue;
      return Error{"script '" + script.name + "': it waits for '" + name +
                   "', but nothing in the scenario or the model has this name" + suggestion(name, names)};
    }
  }
  return {};
}

}  // namespace parhelion::tick
