#include "server/runtime/trainee_view.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace parhelion::runtime {
namespace {

bool is_name_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
}

/// The first place at or after `from` where `word` stands by itself.
std::size_t find_name(const std::string& text, const std::string& word, std::size_t from = 0) {
  for (std::size_t at = text.find(word, from); at != std::string::npos; at = text.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    const bool begins = at == 0 || !is_name_character(text[at - 1]);
    if (begins && (end == text.size() || !is_name_character(text[end]))) return at;
  }
  return std::string::npos;
}

/// Whether a part of the condition asks to report `name`.
bool asks_to_report(const Condition& condition, const std::string& name) {
  const auto asks = [&](const Condition& part) { return asks_to_report(part, name); };
  return (condition.kind == Condition::Kind::report && condition.target == name) ||
         std::any_of(condition.parts.begin(), condition.parts.end(), asks);
}

bool is_to_be_found(const Scenario& scenario, const std::string& name) {
  if (!scenario.training) return false;
  const auto& tasks = scenario.training->tasks;
  return std::any_of(tasks.begin(), tasks.end(),
                     [&](const Task& task) { return asks_to_report(task.done, name); });
}

const char* kind_prefix(AgentKind kind) {
  return kind == AgentKind::person ? "person " : kind == AgentKind::robot ? "robot " : "object ";
}

/// Kinds about a trainee's robot that the trainee notices, or that console and score show.
bool is_noticed(EventKind kind) {
  switch (kind) {
    case EventKind::contact_started:
    case EventKind::contact_ended:
    case EventKind::localization_lost:
    case EventKind::localized:
    case EventKind::relocalized:
    case EventKind::speed_limited:
    case EventKind::speed_limit_lifted:
    case EventKind::injection_suspended:
    case EventKind::injection_active:
    case EventKind::model_changed:
    case EventKind::movement_started:
    case EventKind::movement_stopped:
    case EventKind::joint_broken:
    case EventKind::joint_overload:
    case EventKind::joints_restored:
    case EventKind::door_space_entered:
    case EventKind::door_space_left:
    case EventKind::step_climbed:
    case EventKind::fell:
    case EventKind::tipped_over:
    case EventKind::pitch_warning:
    case EventKind::pitch_limit:
    case EventKind::roll_warning:
    case EventKind::roll_limit:
    case EventKind::yaw_rate_warning:
    case EventKind::yaw_rate_limit:
    case EventKind::gripped:
    case EventKind::lifted:
    case EventKind::dropped:
    case EventKind::placed:
    case EventKind::zone_entered:
    case EventKind::zone_left:
    case EventKind::collision_predicted:
    case EventKind::tipping_predicted:
    case EventKind::radio_lost:
    case EventKind::radio_restored:
    case EventKind::battery_low:
    case EventKind::battery_empty:
    case EventKind::task_started:
    case EventKind::task_done:
    case EventKind::task_failed:
    case EventKind::points_deducted:
    case EventKind::score_changed:
    case EventKind::grading_ended:
    case EventKind::object_reported:
    case EventKind::dead_man_pressed:
    case EventKind::dead_man_released:
    case EventKind::near_miss:
    case EventKind::odometry_changed:
    case EventKind::poses_conflict:
    case EventKind::scans_conflict:
    case EventKind::training_started:
    case EventKind::person_touched:
    case EventKind::dose_warning:
    case EventKind::dose_limit:
    case EventKind::payload_exceeded:
    case EventKind::joint_limited:
    case EventKind::joint_limit_lifted:
    case EventKind::encoders_lost:
    case EventKind::encoders_back:
      return true;
    // The instructor's, of other bodies, or what the trainee is to notice by himself.
    case EventKind::command_accepted:
    case EventKind::command_refused:
    case EventKind::agent_spawned:
    case EventKind::agent_moved:
    case EventKind::agent_removed:
    case EventKind::contact_continues:
    case EventKind::door_opened:
    case EventKind::door_closed:
    case EventKind::door_unhinged:
    case EventKind::hazard_triggered:
    case EventKind::operator_switched:
    case EventKind::console_lost:
    case EventKind::foreign_publisher:
    case EventKind::goal_reached:
    case EventKind::goal_unreachable:
    case EventKind::script_started:
    case EventKind::fault_started:
    case EventKind::fault_ended:
    case EventKind::agent_hidden:
    case EventKind::agent_shown:
      return false;
  }
  return false;
}

constexpr const char* kUnknown = "something";

void stand_still(WorldMessage::Entry& body) {
  body.velocity.setZero();
  body.rotation_rate.setZero();
}

}  // namespace

TraineeView::TraineeView(const tick::Configuration& configuration, const Knowledge& knowledge,
                         std::vector<std::string> robots)
    : configuration_(configuration), knowledge_(knowledge), robots_(std::move(robots)) {}

bool TraineeView::is_shown(const std::string& name) const {
  const auto& shown = configuration_.scenario.shown;
  return std::find(shown.begin(), shown.end(), name) != shown.end();
}

/// A zone that the trainee is told to reach, or to leave, is drawn.
bool TraineeView::knows_zone(const std::string& zone) const { return is_shown(zone) || is_in_briefing(zone); }

bool TraineeView::is_own(const std::string& robot) const {
  return std::find(robots_.begin(), robots_.end(), robot) != robots_.end();
}

bool TraineeView::may_follow(const std::string& robot) const {
  return knowledge_.is_trainees(robot) || is_own(robot);
}

bool TraineeView::is_known(const std::string& name) const {
  return may_follow(name) || is_shown(name) || sensed(name) != nullptr;
}

/// Also one that was removed and forgotten.
bool TraineeView::is_agent(const std::string& name) const {
  if (knowledge_.agents().contains(name)) return true;
  const auto& building = configuration_.model.entities;
  return knowledge_.has_forgotten(name) && !may_follow(name) &&
         std::none_of(building.begin(), building.end(),
                      [&](const ModelEntity& entity) { return entity.name == name; });
}

bool TraineeView::is_in_briefing(const std::string& name) const {
  return find_name(knowledge_.briefing(), name) != std::string::npos;
}

const Sensed* TraineeView::sensed(const std::string& entity) const {
  const Sensed* newest = nullptr;
  for (const std::string& robot : robots_) {
    const auto& known = knowledge_.sensed_by(robot);
    const auto found = known.find(entity);
    if (found == known.end()) continue;
    if (newest == nullptr || newest->last < found->second.last) newest = &found->second;
  }
  return newest;
}

std::string TraineeView::name_of(const std::string& entity) const {
  if (may_follow(entity) || is_shown(entity) || !is_agent(entity)) return entity;
  const Sensed* known = sensed(entity);
  if (known == nullptr) return {};
  const bool named = std::any_of(robots_.begin(), robots_.end(), [&](const std::string& robot) {
    return knowledge_.reported(robot, entity);
  });
  if (named || (!is_to_be_found(configuration_.scenario, entity) && is_in_briefing(entity))) return entity;
  const AgentKind kind = known->bodies.empty() ? AgentKind::box : known->bodies.front().kind;
  return kind_prefix(kind) + std::to_string(knowledge_.number_of(entity));
}

std::string TraineeView::entity_of(const std::string& name) const {
  for (const std::string& robot : robots_) {
    for (const auto& [entity, sensed] : knowledge_.sensed_by(robot))
      if (name_of(entity) == name) return entity;
  }
  return name;
}

KnownWorld TraineeView::world(const WorldMessage& world) const {
  KnownWorld known;
  known.message = world;
  known.message.bodies.clear();
  std::set<std::string, std::less<>> there;
  for (const WorldMessage::Entry& body : world.bodies) {
    // A real robot or person whom a trainee does not see would be a danger.
    const bool live =
        may_follow(body.entity) || is_shown(body.entity) || body.owner == BodyOwner::real_person;
    if (live) known.message.bodies.push_back(body);
    if (there.insert(body.entity).second && !live) add(body.entity, world, known);
  }
  // What was removed since: the trainee does not know of it.
  for (const std::string& robot : robots_) {
    for (const auto& [entity, sensed] : knowledge_.sensed_by(robot))
      if (there.insert(entity).second) add(entity, world, known);
  }
  return known;
}

/// Adds what was sensed of the entity.
void TraineeView::add(const std::string& entity, const WorldMessage& world, KnownWorld& known) const {
  const Sensed* sensed = this->sensed(entity);
  if (sensed == nullptr) return;
  const std::string name = name_of(entity);
  const bool now = SimulationTime{world.stamp.ns} - sensed->last < kSensedNow;
  known.things[name] = {sensed->last, sensed->by, now};
  for (WorldMessage::Entry body : sensed->bodies) {
    body.entity = name;
    if (!now) stand_still(body);
    known.message.bodies.push_back(std::move(body));
  }
}

bool TraineeView::is_for_him(const Event& event) const {
  if (event.kind == EventKind::training_started) return true;
  if (!is_noticed(event.kind) || !(event.subject.empty() || is_own(event.subject))) return false;
  if (event.kind == EventKind::zone_entered || event.kind == EventKind::zone_left)
    return knows_zone(event.object);
  return !is_agent(event.object) || is_known(event.object) || event.kind == EventKind::object_reported;
}

std::optional<Event> TraineeView::event(const Event& event) const {
  if (!is_for_him(event)) return std::nullopt;
  Event shown = event;
  shown.text = text(event.text);
  if (const std::string name = name_of(event.object); !name.empty()) {
    shown.object = name;
  } else if (knowledge_.has_forgotten(event.object)) {
    shown.object = kUnknown;
  }
  if (event.kind == EventKind::object_reported) shown.value = -1;  // else it would lead to the place
  // What decided a task or a penalty may lie where nothing was sensed.
  if (is_grading(event.kind)) shown.position.setZero();
  shown.request = 0;
  return shown;
}

std::string TraineeView::text(const std::string& text) const {
  std::string shown = text;
  for (const std::string& agent : knowledge_.agents()) {
    std::size_t at = find_name(shown, agent);
    if (at == std::string::npos || may_follow(agent)) continue;
    std::string name = name_of(agent);
    if (name.empty()) name = kUnknown;
    for (; at != std::string::npos; at = find_name(shown, agent, at + name.size()))
      shown.replace(at, agent.size(), name);
  }
  replace_forgotten(shown);
  return shown;
}

void TraineeView::replace_forgotten(std::string& text) const {
  for (auto begin = text.begin();
       (begin = std::find_if(begin, text.end(), is_name_character)) != text.end();) {
    auto end = std::find_if_not(begin, text.end(), is_name_character);
    const std::string word(begin, end);
    const auto at = begin - text.begin();
    if (knowledge_.has_forgotten(word) && !knowledge_.agents().contains(word) && is_agent(word)) {
      text.replace(begin, end, kUnknown);
      begin = text.begin() + at + static_cast<std::ptrdiff_t>(std::string_view(kUnknown).size());
    } else {
      begin = end;
    }
  }
}

std::vector<Zone> TraineeView::zones() const {
  std::vector<Zone> zones;
  for (const Zone& zone : configuration_.scenario.zones)
    if (knows_zone(zone.name)) zones.push_back(zone);
  return zones;
}

}  // namespace parhelion::runtime
