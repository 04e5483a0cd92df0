#include "server/simulation/behaviour/admission.hpp"

#include <algorithm>
#include <cmath>

#include "protocols/channel_map.hpp"
#include "protocols/length_text.hpp"
#include "protocols/nearest_name.hpp"
#include "server/simulation/world/free_place.hpp"
#include "server/simulation/world/place_text.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kMaxSpeed = 3.0;    // m/s, limit for behaviours
constexpr double kMaxDistance = 50;  // m, limit for distances of behaviours

Status check_model(const AgentDefinition& agent, const SimulationOptions& options) {
  if (agent.model.empty()) return {};
  const std::string who = "agent '" + agent.name + "': ";
  if (agent.kind != AgentKind::robot) return Error{who + "only a robot has a robot model"};
  if (find_model(agent.model, options)) return {};
  std::vector<std::string> known;
  for (const auto& model : options.robot_models) known.push_back(model->name);
  return Error{who + "no robot model '" + agent.model + "'" + suggestion_or_known(agent.model, known)};
}

/// Rejects goals where nobody can stand; reachability of the others is found out by the route search.
Status check_goals(const AgentDefinition& agent, const SimulationOptions& options, const Building& building) {
  const AgentForm form = form_of(agent, options);
  for (const Eigen::Vector2d& goal : agent.behaviour.waypoints) {
    const double floor = building.floor_height(goal);
    std::vector<const FixedObstacle*> beside;
    building.near(goal, form.footprint.bound, floor + 0.02, floor + form.size.z(), beside);
    const Footprint there = make_disc(goal, form.footprint.bound);
    for (const FixedObstacle* obstacle : beside) {
      if (obstacle->label == EntityLabel::door || signed_distance(there, obstacle->footprint) >= 0) continue;
      return Error{"agent '" + agent.name + "': it cannot go to " + place_text(goal) +
                   ": there is not enough space next to '" + obstacle->name + "' of the building"};
    }
  }
  return {};
}

}  // namespace

std::shared_ptr<const RobotModel> find_model(const std::string& name, const SimulationOptions& options) {
  const auto at = std::find_if(options.robot_models.begin(), options.robot_models.end(),
                               [&](const auto& model) { return model->name == name; });
  return at == options.robot_models.end() ? nullptr : *at;
}

AgentForm form_of(const AgentDefinition& agent, const SimulationOptions& options) {
  const auto model = agent.model.empty() ? nullptr : find_model(agent.model, options);
  if (model) return robot_form(*model);
  AgentForm form = agent_form(agent);
  if (agent.mass > 0) form.mass = agent.mass;
  return form;
}

Status check_behaviour(const AgentDefinition& agent, const SimulationOptions& options,
                       const Building& building) {
  const Behaviour& behaviour = agent.behaviour;
  const std::string who = "agent '" + agent.name + "': ";
  const bool moves = agent.kind == AgentKind::person || agent.kind == AgentKind::robot;
  if (!moves && behaviour.kind != BehaviourKind::stay) {
    return Error{who + "a " + to_string(agent.kind) + " cannot " + to_string(behaviour.kind) +
                 "; only persons and robots move by themselves"};
  }
  if (!std::isfinite(behaviour.speed) || behaviour.speed < 0 || behaviour.speed > kMaxSpeed) {
    return Error{who + "speed " + std::to_string(behaviour.speed) + " m/s; expected 0 to " +
                 length_text(kMaxSpeed) + "/s"};
  }
  const bool follows_waypoints =
      behaviour.kind == BehaviourKind::patrol || behaviour.kind == BehaviourKind::go;
  if (follows_waypoints && behaviour.waypoints.empty()) {
    return Error{who + "to " + to_string(behaviour.kind) + " it needs at least one waypoint"};
  }
  if (!std::isfinite(behaviour.distance) || behaviour.distance < 0 || behaviour.distance > kMaxDistance) {
    return Error{who + "distance " + std::to_string(behaviour.distance) + " m; expected 0 to " +
                 length_text(kMaxDistance)};
  }
  for (const Eigen::Vector2d& waypoint : behaviour.waypoints) {
    if (!waypoint.allFinite() || waypoint.lpNorm<Eigen::Infinity>() > kMaxCoordinate)
      return Error{who + "a waypoint is not finite or farther than 100 km; expected x, y in metres"};
    if (const std::string wrong = off_site(building, waypoint); !wrong.empty())
      return Error{who + "its waypoint " + wrong};
  }
  if (behaviour.kind == BehaviourKind::go) return check_goals(agent, options, building);
  const bool has_target = behaviour.kind == BehaviourKind::follow || behaviour.kind == BehaviourKind::flee ||
                          behaviour.kind == BehaviourKind::block;
  if (has_target && behaviour.target == agent.name)
    return Error{who + "it cannot " + to_string(behaviour.kind) + " itself; name another target"};
  return {};
}

Status check_definition(const AgentDefinition& agent, bool trainee, const SimulationOptions& options,
                        const Building& building, const Agents& agents, const RealRobots& real_robots) {
  if (const std::string fault = agent_name_fault(agent.name); !fault.empty())
    return Error{"agent name: " + fault};
  if (agents.find(agent.name) != nullptr)
    return Error{"there is an agent '" + agent.name + "' already; choose another name, or move it"};
  const bool is_real = std::any_of(real_robots.begin(), real_robots.end(),
                                   [&](const RealRobot& robot) { return robot.name == agent.name; });
  if (is_real && !trainee)
    return Error{"agent '" + agent.name + "' has the real robot's name; choose another"};
  const auto& fixed = building.obstacles();
  if (std::any_of(fixed.begin(), fixed.end(), [&](const FixedObstacle& o) { return o.name == agent.name; })) {
    return Error{"agent '" + agent.name + "' has the name of a part of the building; choose another"};
  }
  const auto of_session = static_cast<std::size_t>(
      std::count_if(agents.begin(), agents.end(), [](const Agent& each) { return !each.of_site; }));
  if (of_session >= options.max_agents) {
    return Error{
        "there are " + std::to_string(of_session) +
        " agents, the most that the scenario's max_agents allows; remove some, or raise max_agents if "
        "this machine can simulate more in real time"};
  }
  if (Status status = check_size(agent); !status) return status;
  if (Status status = check_model(agent, options); !status) return status;
  return check_behaviour(agent, options, building);
}

}  // namespace parhelion::simulation
