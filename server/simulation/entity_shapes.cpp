#include "server/simulation/entity_shapes.hpp"

#include <algorithm>
#include <utility>

#include "protocols/convex_hull.hpp"
#include "server/simulation/bodies/bodies.hpp"
#include "server/simulation/bodies/movable_objects.hpp"
#include "server/simulation/bodies/real_people.hpp"
#include "server/simulation/building/doors.hpp"
#include "server/simulation/robots/robot_layout.hpp"
#include "server/simulation/simulation.hpp"

namespace parhelion::simulation {
namespace {

/// Limit of unanswered commands; instructors send few at a time.
constexpr std::size_t kMaxRequests = 1000;

EntityShapes::Parts parts_of(const RobotModel& model) {
  EntityShapes::Parts parts;
  for (const RobotNode& node : make_layout(model).nodes) parts[model.links[node.link].name] = node.visible;
  return parts;
}

EntityShapes::Parts parts_of(const AgentDefinition& agent) {
  EntityShapes::Parts parts;
  for (BodyDefinition& body : agent_bodies(agent, 1)) parts[body.part] = std::move(body.shapes);
  return parts;
}

}  // namespace

EntityShapes::EntityShapes(const Scenario& scenario, const RobotDescription& robot,
                           const SemanticModel& model,
                           std::vector<std::shared_ptr<const RobotModel>> robot_models)
    : scenario_(scenario), robot_models_(std::move(robot_models)) {
  if (scenario.trainee && scenario.level < 3) {
    AgentDefinition trainee;
    trainee.name = scenario.trainee->name;
    trainee.kind = AgentKind::robot;
    trainee.model = scenario.trainee->model;
    stand(trainee);
  } else {
    add(robot);
  }
  for (const AgentDefinition& agent : scenario.agents) stand(agent);
  take(model);
}

void EntityShapes::add(const RobotDescription& robot) {
  if (const RobotModel* model = robot.model.empty() ? nullptr : model_of(robot.model)) {
    shapes_[robot.name] = parts_of(*model);
    return;
  }
  shapes_[robot.name]["base"] = outline_shapes(convex_hull(robot.footprint), robot.height);
}

void EntityShapes::add(const std::vector<ModelObject>& objects) {
  for (const ModelObject& object : objects) {
    definitions_[object.name] = object_agent(object);
    BodyDefinition body = object_body(object, 1);
    shapes_[object.name][body.part] = std::move(body.shapes);
  }
}

const RobotModel* EntityShapes::model_of(const std::string& name) const {
  const auto found = std::find_if(robot_models_.begin(), robot_models_.end(),
                                  [&](const auto& model) { return model->name == name; });
  return found == robot_models_.end() ? nullptr : found->get();
}

void EntityShapes::note_removal(const std::string& agent) {
  const auto of_scenario = [&](const AgentDefinition& each) { return each.name == agent; };
  if (std::any_of(scenario_.agents.begin(), scenario_.agents.end(), of_scenario)) return;
  std::erase(removed_, agent);
  removed_.push_back(agent);
  if (removed_.size() <= kMaxRemoved) return;
  definitions_.erase(removed_.front());
  shapes_.erase(removed_.front());
  removed_.pop_front();
}

void EntityShapes::stand(const AgentDefinition& agent) {
  definitions_[agent.name] = agent;
  if (agent.model.empty()) {
    shapes_[agent.name] = parts_of(agent);
  } else if (const RobotModel* model = model_of(agent.model)) {
    shapes_[agent.name] = parts_of(*model);
  } else {
    shapes_.erase(agent.name);
  }
}

void EntityShapes::take(const AgentSpawn& command) {
  asked_[command.request] = command.agent;
  if (asked_.size() > kMaxRequests) asked_.erase(asked_.begin());
}

void EntityShapes::take(const Event& event) {
  if (event.kind == EventKind::command_refused) asked_.erase(event.request);
  if (event.kind == EventKind::agent_removed) note_removal(event.subject);
  if (event.kind != EventKind::agent_spawned) return;
  std::erase(removed_, event.subject);
  const auto asked = asked_.find(event.request);
  if (asked != asked_.end() && asked->second.name == event.subject) {
    stand(asked->second);
    asked_.erase(asked);
    return;
  }
  for (const Script& script : scenario_.scripts) {
    for (const AgentCommand& action : script.actions) {
      const auto* spawn = std::get_if<AgentSpawn>(&action);
      if (spawn && spawn->agent.name == event.subject && event.text == to_string(spawn->agent.kind))
        return stand(spawn->agent);
    }
  }
}

void EntityShapes::take(const SemanticModel& model) {
  doors_.clear();
  for (const ModelEntity& entity : model.entities) {
    if (entity.label != EntityLabel::door || entity.deleted) continue;
    const Door door = make_door(entity, {}, {scenario_.level, scenario_.doors});
    doors_[entity.name][to_string(entity.label)] = leaf_shapes(door);
  }
}

const std::vector<Shape>* EntityShapes::find(std::string_view entity, std::string_view part) const {
  for (const auto* all : {&shapes_, &doors_}) {
    const auto parts = all->find(entity);
    if (parts == all->end()) continue;
    const auto found = parts->second.find(part);
    if (found != parts->second.end()) return &found->second;
  }
  return names_real_person(entity) ? &real_person_shapes() : nullptr;
}

const AgentDefinition* EntityShapes::definition(std::string_view entity) const {
  const auto found = definitions_.find(entity);
  return found == definitions_.end() ? nullptr : &found->second;
}

std::optional<Transform<Base, Laser>> EntityShapes::laser_mount(std::string_view entity) const {
  const AgentDefinition* agent = definition(entity);
  if (agent == nullptr || agent->laser.empty()) return std::nullopt;
  const RobotModel* model = agent->model.empty() ? nullptr : model_of(agent->model);
  return model && model->description.laser ? model->description.laser->T_base_laser : agent_laser_mount();
}

}  // namespace parhelion::simulation
