#include "server/runtime/knowledge.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "protocols/hash.hpp"
#include "server/simulation/robots/base_body.hpp"
#include "server/training/briefing.hpp"

namespace parhelion::runtime {
namespace {

const WorldMessage::Entry* first_body(const WorldMessage& world, const std::string& entity) {
  const auto found = std::find_if(world.bodies.begin(), world.bodies.end(),
                                  [&](const WorldMessage::Entry& body) { return body.entity == entity; });
  return found == world.bodies.end() ? nullptr : &*found;
}

std::set<std::string, std::less<>> agents_of(const Scenario& scenario) {
  const std::vector<std::string> names = agent_names(scenario);
  return {names.begin(), names.end()};
}

double range_of(const LaserDescription& laser) {
  const double range = laser.convention.range_max;
  return range > 0 ? range : std::numeric_limits<double>::infinity();
}

/// Places of a name in the filter of forgotten ones: double hashing (Kirsch and Mitzenmacher, "Less hashing,
/// same performance", 2008).
constexpr std::size_t kForgottenBits = std::size_t{1} << 23;
std::array<std::size_t, 4> places_of(std::string_view name) {
  const std::uint64_t hash = fnv1a(name);
  const std::uint64_t step = (hash >> 32) | 1;
  std::array<std::size_t, 4> places{};
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = (hash + i * step) % kForgottenBits;
  return places;
}

}  // namespace

const char* to_string(SensedBy by) {
  static constexpr const char* words[] = {"laser", "camera", "touch"};
  return words[static_cast<std::size_t>(by)];
}

std::string trainee_briefing(const tick::Configuration& configuration) {
  if (!configuration.scenario.training) return {};
  Scenario shown = configuration.scenario;
  shown.drawn_values.clear();
  return training::briefing(shown, tick::graded_robots(configuration));
}

bool is_driven_by_trainees(const tick::Configuration& configuration, const AgentDefinition& agent) {
  const auto& training = configuration.scenario.training;
  return agent.behaviour.kind == BehaviourKind::teleop || (training && training->robot == agent.name);
}

Knowledge::Knowledge(const tick::Configuration& configuration, const simulation::EntityShapes& shapes)
    : configuration_(configuration),
      shapes_(shapes),
      briefing_(trainee_briefing(configuration)),
      visibility_(configuration.model),
      agents_of_scenario_(agents_of(configuration.scenario)),
      agents_(agents_of_scenario_) {}

void Knowledge::restart() {
  agents_ = agents_of_scenario_;
  sensed_.clear();
  reported_.clear();
  numbers_.clear();
  last_number_ = 0;
  removals_.clear();
  removed_.clear();
  forgotten_.clear();
}

void Knowledge::note(const std::string& robot, const std::string& entity, SensedBy by,
                     const WorldMessage& world) {
  if (entity == robot || first_body(world, entity) == nullptr) return;
  if (const auto [number, is_first] = numbers_.try_emplace(entity, last_number_ + 1); is_first)
    last_number_ = number->second;
  const auto [place, is_new] = sensed_[robot].try_emplace(entity);
  Sensed& sensed = place->second;
  const SimulationTime now{world.stamp.ns};
  if (is_new) sensed.first = now;
  sensed.last = now;
  sensed.by = by;
  sensed.bodies.clear();
  for (const WorldMessage::Entry& body : world.bodies)
    if (body.entity == entity) sensed.bodies.push_back(body);
}

/// Doors are no agents: MR_SCAN_INFO does not name them.
void Knowledge::look_for_doors(const std::string& robot, const std::optional<LaserDescription>& laser,
                               const WorldMessage& world) {
  const WorldMessage::Entry* body = first_body(world, robot);
  const bool any = std::any_of(world.bodies.begin(), world.bodies.end(),
                               [](const auto& each) { return each.owner == BodyOwner::building; });
  if (body == nullptr || !laser || !any) return;
  visibility_.set_bodies(world, shapes_);
  const auto T_map_laser = simulation::base_of(body->T_map_body) * laser->T_base_laser;
  for (const std::string& entity : visibility_.in_laser(T_map_laser, range_of(*laser), robot)) {
    if (first_body(world, entity)->owner == BodyOwner::building) note(robot, entity, SensedBy::laser, world);
  }
}

void Knowledge::look(const std::string& robot, const RobotDescription& description,
                     const WorldMessage& world) {
  const WorldMessage::Entry* body = first_body(world, robot);
  if (body == nullptr || !description.camera) return;
  visibility_.set_bodies(world, shapes_);
  const auto T_map_optical = simulation::base_of(body->T_map_body) * description.camera->T_base_optical;
  for (const std::string& entity :
       visibility_.in_camera(T_map_optical, description.camera->intrinsics, robot))
    note(robot, entity, SensedBy::camera, world);
}

void Knowledge::handle_scan(const ScanInfo& info, std::size_t robot, const WorldMessage& world) {
  const RobotDescription& description = configuration_.robot_at(robot);
  std::vector<bool> met(info.agents.size(), false);
  for (const std::int16_t agent : info.beam_agent)
    if (agent >= 0 && static_cast<std::size_t>(agent) < met.size())
      met[static_cast<std::size_t>(agent)] = true;
  for (std::size_t i = 0; i < met.size(); ++i)
    if (met[i]) note(description.name, info.agents[i], SensedBy::laser, world);
  look_for_doors(description.name, description.laser, world);
}

void Knowledge::handle_picture(std::size_t robot, const WorldMessage& world) {
  const RobotDescription& description = configuration_.robot_at(robot);
  look(description.name, description, world);
}

const RobotDescription* Knowledge::model_of(const AgentDefinition& agent) const {
  const auto& models = configuration_.robot_models;
  const auto found =
      std::find_if(models.begin(), models.end(), [&](const auto& each) { return each->name == agent.model; });
  return found == models.end() ? nullptr : &(*found)->description;
}

void Knowledge::handle_scan_of(const AgentDefinition& agent, const WorldMessage& world) {
  const WorldMessage::Entry* body = first_body(world, agent.name);
  const auto T_base_laser = shapes_.laser_mount(agent.name);
  const RobotDescription* model = model_of(agent);
  if (body == nullptr || !T_base_laser) return;
  visibility_.set_bodies(world, shapes_);
  const double range =
      model != nullptr && model->laser ? range_of(*model->laser) : std::numeric_limits<double>::infinity();
  const auto T_map_laser = simulation::base_of(body->T_map_body) * *T_base_laser;
  for (const std::string& entity : visibility_.in_laser(T_map_laser, range, agent.name))
    note(agent.name, entity, SensedBy::laser, world);
}

void Knowledge::handle_picture_of(const AgentDefinition& agent, const WorldMessage& world) {
  if (const RobotDescription* model = model_of(agent)) look(agent.name, *model, world);
}

void Knowledge::take(const Event& event, const WorldMessage& world) {
  if (event.kind == EventKind::agent_spawned) {
    agents_.insert(event.subject);
    removed_.erase(event.subject);
  }
  if (event.kind == EventKind::agent_removed) note_removal(event.subject);
  if (event.kind == EventKind::object_reported && agents_.contains(event.object))
    reported_[event.subject].insert(event.object);
  if (event.kind != EventKind::contact_started || event.undetectable) return;
  // The building is no entity of the world, and so is not noted.
  if (is_trainees(event.subject)) note(event.subject, event.object, SensedBy::touch, world);
  if (is_trainees(event.object)) note(event.object, event.subject, SensedBy::touch, world);
}

/// Names come and go as long as the session runs.
void Knowledge::note_removal(const std::string& agent) {
  constexpr std::size_t kMaxRemoved = 4096;
  if (agents_of_scenario_.contains(agent)) return;
  removed_[agent] = ++last_removal_;
  removals_.emplace_back(agent, last_removal_);
  if (removals_.size() <= kMaxRemoved) return;
  const auto [oldest, number] = std::move(removals_.front());
  removals_.pop_front();
  const auto last = removed_.find(oldest);  // it may have been added, or removed, again
  if (last != removed_.end() && last->second == number) forget(oldest);
}

void Knowledge::forget(const std::string& agent) {
  forgotten_.resize(kForgottenBits);
  for (const std::size_t place : places_of(agent)) forgotten_[place] = true;
  removed_.erase(agent);
  agents_.erase(agent);
  numbers_.erase(agent);
  for (auto& [robot, sensed] : sensed_) sensed.erase(agent);
  for (auto& [robot, reported] : reported_) reported.erase(agent);
}

bool Knowledge::has_forgotten(std::string_view name) const {
  if (forgotten_.empty()) return false;
  const auto places = places_of(name);
  return std::all_of(places.begin(), places.end(), [&](std::size_t place) { return forgotten_[place]; });
}

bool Knowledge::is_trainees(const std::string& robot) const {
  if (configuration_.find_robot(robot)) return true;
  const AgentDefinition* agent = shapes_.definition(robot);
  return agent != nullptr && is_driven_by_trainees(configuration_, *agent);
}

const Knowledge::ByEntity& Knowledge::sensed_by(const std::string& robot) const {
  static const ByEntity none;
  const auto found = sensed_.find(robot);
  return found == sensed_.end() ? none : found->second;
}

bool Knowledge::reported(const std::string& robot, const std::string& entity) const {
  const auto found = reported_.find(robot);
  return found != reported_.end() && found->second.contains(entity);
}

std::size_t Knowledge::number_of(const std::string& entity) const {
  const auto found = numbers_.find(entity);
  return found == numbers_.end() ? 0 : found->second;
}

}  // namespace parhelion::runtime
