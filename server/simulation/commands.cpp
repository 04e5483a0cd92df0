#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/simulation/state.hpp"

namespace parhelion {
namespace {

constexpr double kGap = 0.02;         // m kept free between an agent that appears and what is there
constexpr double kSearchRange = 6.0;  // m
constexpr double kMostSpeed = 3.0;    // m/s that a behaviour may ask for
constexpr double kMostDistance = 50;  // m that a behaviour may keep
constexpr double kMostPlace = 1e5;    // m from the map's origin

bool fits_a_channel(const std::string& name) {
  return !name.empty() && name.size() <= 40 && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

std::string metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

std::string place_text(const Pose2& pose) { return "(" + metres(pose.x) + ", " + metres(pose.y) + ")"; }

bool finite(const Twist2& twist) {
  return std::isfinite(twist.vx) && std::isfinite(twist.vy) && std::isfinite(twist.wz);
}

}  // namespace

std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, changed});
    }
  }
  return row.back();
}

std::uint64_t name_key(const std::string& name) {
  std::uint64_t key = 14695981039346656037ULL;
  for (const unsigned char c : name) key = (key ^ c) * 1099511628211ULL;
  return key;
}

void Simulation::State::say(EventKind kind, const Agent& agent, std::uint64_t request, std::string text) {
  Event event;
  event.stamp = stamp_of(step);
  event.kind = kind;
  event.subject = agent.definition.name;
  event.position = {agent.pose.x, agent.pose.y, agent.floor};
  event.request = request;
  event.text = std::move(text);
  events.push_back(std::move(event));
}

Status Simulation::State::unknown(const std::string& name) const {
  const Agent* nearest = nullptr;
  for (const auto& agent : agents) {
    if (!nearest || edits(name, agent->definition.name) < edits(name, nearest->definition.name))
      nearest = agent.get();
  }
  if (!nearest) return Error{"no agent '" + name + "': there are none; spawn it first"};
  return Error{"no agent '" + name + "'; did you mean '" + nearest->definition.name + "'?"};
}

Status Simulation::State::check_behaviour(const AgentDefinition& agent) const {
  const Behaviour& behaviour = agent.behaviour;
  const std::string who = "agent '" + agent.name + "': ";
  const bool moves = agent.kind == AgentKind::person || agent.kind == AgentKind::robot;
  if (!moves && behaviour.kind != BehaviourKind::stay) {
    return Error{who + "a " + to_string(agent.kind) + " cannot " + to_string(behaviour.kind) +
                 "; only persons and robots move by themselves"};
  }
  if (!std::isfinite(behaviour.speed) || behaviour.speed < 0 || behaviour.speed > kMostSpeed) {
    return Error{who + "speed " + std::to_string(behaviour.speed) + " m/s; expected 0 to " +
                 metres(kMostSpeed)};
  }
  const bool on_its_way = behaviour.kind == BehaviourKind::patrol || behaviour.kind == BehaviourKind::go;
  if (on_its_way && behaviour.waypoints.empty()) {
    return Error{who + "to " + to_string(behaviour.kind) + " it needs at least one waypoint"};
  }
  if (!std::isfinite(behaviour.distance) || behaviour.distance < 0 || behaviour.distance > kMostDistance) {
    return Error{who + "distance " + std::to_string(behaviour.distance) + " m; expected 0 to " +
                 metres(kMostDistance)};
  }
  for (const Eigen::Vector2d& waypoint : behaviour.waypoints) {
    if (!waypoint.allFinite() || waypoint.lpNorm<Eigen::Infinity>() > kMostPlace)
      return Error{who + "a waypoint is not finite or farther than 100 km; expected x, y in metres"};
  }
  if (behaviour.kind == BehaviourKind::go) return check_goals(agent);
  const bool has_target = behaviour.kind == BehaviourKind::follow || behaviour.kind == BehaviourKind::flee ||
                          behaviour.kind == BehaviourKind::block;
  if (has_target && behaviour.target == agent.name)
    return Error{who + "it cannot " + to_string(behaviour.kind) + " itself; name another target"};
  return {};
}

/// Goals where nobody can stand; whether a way leads to the others is found out as it goes.
Status Simulation::State::check_goals(const AgentDefinition& agent) const {
  const AgentForm form = form_of(agent);
  for (const Eigen::Vector2d& goal : agent.behaviour.waypoints) {
    const double floor = building->floor_height(goal);
    std::vector<const FixedObstacle*> beside;
    building->near(goal, form.footprint.bound, floor + 0.02, floor + form.size.z(), beside);
    const Footprint there = make_disc(goal, form.footprint.bound);
    for (const FixedObstacle* obstacle : beside) {
      if (obstacle->label == EntityLabel::door || signed_distance(there, obstacle->footprint) >= 0) continue;
      return Error{"agent '" + agent.name + "': it cannot go to " + place_text({goal.x(), goal.y(), 0}) +
                   ": it has no room there beside '" + obstacle->name + "' of the building"};
    }
  }
  return {};
}

std::shared_ptr<const RobotModel> Simulation::State::find_model(const std::string& name) const {
  const auto at = std::find_if(options.robot_models.begin(), options.robot_models.end(),
                               [&](const auto& model) { return model->name == name; });
  return at == options.robot_models.end() ? nullptr : *at;
}

Status Simulation::State::check_model(const AgentDefinition& agent) const {
  if (agent.model.empty()) return {};
  const std::string who = "agent '" + agent.name + "': ";
  if (agent.kind != AgentKind::robot) return Error{who + "only a robot has a robot model"};
  if (find_model(agent.model)) return {};
  std::string known;
  for (const auto& model : options.robot_models) known += (known.empty() ? "" : ", ") + model->name;
  return Error{who + "no robot model '" + agent.model + "'; known: " + (known.empty() ? "none" : known)};
}

AgentForm Simulation::State::form_of(const AgentDefinition& agent) const {
  const auto model = agent.model.empty() ? nullptr : find_model(agent.model);
  return model ? robot_form(*model) : agent_form(agent);
}

Status Simulation::State::check_definition(const AgentDefinition& agent, bool trainee) const {
  if (!fits_a_channel(agent.name)) {
    return Error{"agent name '" + agent.name + "': expected 1 to 40 letters, digits, '_' and '-'"};
  }
  const bool taken = std::any_of(agents.begin(), agents.end(),
                                 [&](const auto& a) { return a->definition.name == agent.name; });
  if (taken) return Error{"there is an agent '" + agent.name + "' already; choose another name, or move it"};
  if (agent.name == real.name && !trainee)
    return Error{"agent '" + agent.name + "' has the real robot's name; choose another"};
  const auto& fixed = building->obstacles();
  if (std::any_of(fixed.begin(), fixed.end(), [&](const FixedObstacle& o) { return o.name == agent.name; })) {
    return Error{"agent '" + agent.name + "' has the name of a part of the building; choose another"};
  }
  if (agents.size() >= options.most_agents) {
    return Error{
        "there are " + std::to_string(agents.size()) +
        " agents, and the scenario's most_agents allows no more: what is stepped and sent in time on "
        "one machine; remove some first, or raise it"};
  }
  if (Status status = check_size(agent); !status) return status;
  if (Status status = check_model(agent); !status) return status;
  return check_behaviour(agent);
}

std::string Simulation::State::occupied(const AgentForm& form, const Pose2& pose, const Agent* except,
                                        const std::vector<Footprint>& zone) {
  Footprint placed;
  place(form.footprint, pose, placed);
  const auto hits = [&placed](const Footprint& other, double gap) {
    return distance_bound(placed, other) < gap && signed_distance(placed, other) < gap;
  };
  if (std::any_of(zone.begin(), zone.end(), [&](const Footprint& f) { return hits(f, 0); })) {
    return "on the real robot or inside its stopping distance";
  }
  const double floor = building->floor_height(pose.position());
  near.clear();
  building->near(placed.center, placed.bound + kGap, floor + 0.02, floor + form.size.z(), near);
  for (const FixedObstacle* obstacle : near) {
    if (hits(obstacle->footprint, kGap)) return "in '" + obstacle->name + "' of the building";
  }
  for (const auto& agent : agents) {
    if (agent.get() != except && hits(agent->placed, kGap))
      return "on agent '" + agent->definition.name + "'";
  }
  for (const Footprint& disc : real_discs) {
    if (hits(disc, kGap)) return "on something real that the model does not explain";
  }
  return {};
}

/// Rings around the place, the nearest first.
std::optional<Pose2> Simulation::State::nearest_free(const AgentForm& form, const Pose2& pose,
                                                     const Agent* except,
                                                     const std::vector<Footprint>& zone) {
  constexpr double spacing = 0.1;  // m
  for (double radius = 0; radius <= kSearchRange; radius += spacing) {
    const int count = std::max(1, static_cast<int>(2 * std::numbers::pi * radius / spacing / 2));
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * i / count;
      const Pose2 candidate{pose.x + radius * std::cos(angle), pose.y + radius * std::sin(angle), pose.yaw};
      if (occupied(form, candidate, except, zone).empty()) return candidate;
    }
  }
  return std::nullopt;
}

Status Simulation::State::check_place(const AgentDefinition& agent, const Agent* except,
                                      const std::optional<RealRobotState>& now) {
  const std::string who = "agent '" + agent.name + "': ";
  const Pose2 pose = planar_pose(agent.T_map_base);
  if (!agent.T_map_base.finite() || std::abs(pose.x) > kMostPlace || std::abs(pose.y) > kMostPlace) {
    return Error{who + "its place is not finite or farther than 100 km; expected metres in the map"};
  }
  std::vector<Footprint> zone;
  if (now && now->T_map_base.finite() && finite(now->twist)) stop_zone(*now, zone);
  // Where the robot is not known now, it is still somewhere near its last place.
  if (!now && real.ever_present) stop_zone(real.last, zone);
  const AgentForm form = form_of(agent);
  const std::string what = occupied(form, pose, except, zone);
  if (what.empty()) return {};
  const auto free = nearest_free(form, pose, except, zone);
  return Error{who + place_text(pose) + " is " + what + "; " +
               (free ? "the nearest free place is " + place_text(*free)
                     : "no free place within " + metres(kSearchRange) + " m")};
}

/// Puts the agent there: a new epoch, nothing in between.
void Simulation::State::put(Agent& agent, const Pose2& pose) {
  ++agent.epoch;
  agent.floor = building->floor_height(pose.position());
  const auto T_map_body = Transform<Map, Body>::planar(pose.x, pose.y, pose.yaw, agent.floor);
  if (agent.robot) {
    agent.robot->put(physics, Transform<Map, Base>(T_map_body.isometry()));
  } else {
    physics.teleport(agent.handle, T_map_body);
  }
  agent.rigid = {T_map_body, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  agent.pose = pose;
  place(agent.form.footprint, pose, agent.placed);
  agent.driven = {};
  agent.steering = {};
  agent.steering.heading = pose.yaw;
  forget_route(agent);
  if (agent.laser) agent.laser->measured.reset();
  contacts.forget(agent.definition.name, stamp_of(step), events);
}

Status Simulation::State::spawn(const AgentDefinition& definition, const std::optional<RealRobotState>& now,
                                std::uint64_t request, bool trainee) {
  if (Status status = check_definition(definition, trainee); !status) return status;
  if (Status status = check_place(definition, nullptr, now); !status) return status;
  auto agent = std::make_unique<Agent>();
  agent->definition = definition;
  agent->form = form_of(definition);
  agent->trainee = trainee;
  if (!definition.model.empty())
    agent->robot = std::make_unique<ArticulatedRobot>(find_model(definition.model));
  agent->key = name_key(definition.name);
  if (Status status = fit_laser(*agent); !status) return status;
  const auto bodies = agent->robot ? agent->robot->bodies(definition.name, next_body,
                                                          trainee ? BodyOwner::real_robot : BodyOwner::agent)
                                   : agent_bodies(definition, next_body);
  agent->first_body = next_body;
  agent->body_count = bodies.size();
  next_body += static_cast<BodyId>(bodies.size());
  for (const BodyDefinition& body : bodies)
    agent_definitions.push_back(std::make_shared<const BodyDefinition>(body));
  const AgentForm& form = agent->form;
  if (agent->robot) {
    agent->robot->enter(physics, definition.T_map_base);
    agent->handle = agent->robot->base();
  } else {
    agent->handle = form.upright ? physics.add_upright(form.shape, form.size, form.mass, {})
                                 : physics.add_free(form.shape, form.size, form.mass, {});
  }
  agent->watch = BodyWatch(agent->robot ? supervised(definition.name, agent->robot->model())
                                        : supervised(definition, form));
  put(*agent, planar_pose(definition.T_map_base));
  say(EventKind::agent_spawned, *agent, request, to_string(definition.kind));
  agents.push_back(std::move(agent));
  rebuild_scene();
  return {};
}

Status Simulation::State::move(const AgentCommand& command, const std::optional<RealRobotState>& now) {
  Agent* agent = find(command.agent.name);
  AgentDefinition moved = agent->definition;
  moved.T_map_base = command.agent.T_map_base;
  if (Status status = check_place(moved, agent, now); !status) return status;
  agent->definition = moved;
  put(*agent, planar_pose(moved.T_map_base));
  say(EventKind::agent_moved, *agent, command.request, {});
  return {};
}

void Simulation::State::remove(std::size_t index, std::uint64_t request) {
  const std::unique_ptr<Agent> agent = std::move(agents[index]);
  agents.erase(agents.begin() + static_cast<std::ptrdiff_t>(index));
  contacts.forget(agent->definition.name, stamp_of(step), events);
  agent->watch.close(stamp_of(step), options.zones, events);
  forget_route(*agent);
  if (agent->robot) {
    agent->robot->leave(physics);
  } else {
    physics.remove(agent->handle);
  }
  std::erase_if(agent_definitions, [&](const auto& body) {
    return body->id >= agent->first_body && body->id < agent->first_body + agent->body_count;
  });
  say(EventKind::agent_removed, *agent, request, {});
  rebuild_scene();
}

Status Simulation::spawn(const AgentDefinition& agent, const std::optional<RealRobotState>& real) {
  return state_->spawn(agent, real, 0);
}

Status Simulation::command(const AgentCommand& command, const std::optional<RealRobotState>& real) {
  using Action = AgentCommand::Action;
  State& state = *state_;
  const std::string& name = command.agent.name;
  if (command.action == Action::spawn) return state.spawn(command.agent, real, command.request);
  if (command.action == Action::remove_all) {
    for (std::size_t i = state.agents.size(); i-- > 0;) {
      if (!state.agents[i]->trainee) state.remove(i, command.request);
    }
    return {};
  }
  if (command.action == Action::door || command.action == Action::door_unknown)
    return state.set_door(command);
  const bool everyone =
      name.empty() && (command.action == Action::freeze || command.action == Action::unfreeze);
  Agent* agent = everyone ? nullptr : state.find(name);
  if (!everyone && !agent) return state.unknown(name);
  switch (command.action) {
    case Action::move:
      return state.move(command, real);
    case Action::remove: {
      if (agent->trainee) return Error{"'" + name + "' is the trainee's robot: it can be moved, not removed"};
      const auto at = std::find_if(state.agents.begin(), state.agents.end(),
                                   [&](const auto& a) { return a.get() == agent; });
      state.remove(static_cast<std::size_t>(at - state.agents.begin()), command.request);
      return {};
    }
    case Action::behave: {
      AgentDefinition changed = agent->definition;
      changed.behaviour = command.agent.behaviour;
      if (Status status = state.check_behaviour(changed); !status) return status;
      const std::string& target = changed.behaviour.target;
      if (!target.empty() && target != state.real.name && !state.find(target)) return state.unknown(target);
      agent->definition = changed;
      agent->steering = {};
      agent->steering.heading = agent->pose.yaw;
      state.forget_route(*agent);
      return {};
    }
    case Action::freeze:
    case Action::unfreeze:
      for (const auto& each : state.agents) {
        if (everyone || each.get() == agent) each->frozen = command.action == Action::freeze;
      }
      return {};
    case Action::spawn:
    case Action::remove_all:
    case Action::door:
    case Action::door_unknown:
      break;
  }
  return Error{"agent command with action " + std::to_string(static_cast<int>(command.action)) +
               "; expected spawn, move, remove, behave, remove_all, freeze, unfreeze, door or door_unknown"};
}

Status Simulation::spawn_trainee(const AgentDefinition& trainee) {
  State& state = *state_;
  for (const auto& agent : state.agents) {
    if (agent->trainee)
      return Error{"'" + agent->definition.name + "' is the trainee's robot already; there is one"};
  }
  if (trainee.model.empty())
    return Error{"the trainee's robot '" + trainee.name + "' needs a robot model to be simulated"};
  AgentDefinition definition = trainee;
  definition.kind = AgentKind::robot;
  definition.behaviour.kind = BehaviourKind::teleop;
  return state.spawn(definition, std::nullopt, 0, true);
}

Status Simulation::joint_command(const std::string& name, const Joints& joints) {
  Agent* agent = state_->find(name);
  if (!agent) return state_->unknown(name);
  if (!agent->robot) return Error{"agent '" + name + "' has no joints that can be commanded"};
  return agent->robot->command(joints, now());
}

Status Simulation::restore_joints(const std::string& name, std::uint64_t request) {
  Agent* agent = state_->find(name);
  if (!agent) return state_->unknown(name);
  if (!agent->robot) return Error{"agent '" + name + "' has no joints that could be restored"};
  agent->robot->restore(state_->physics);
  ++agent->epoch;
  state_->say(EventKind::joints_restored, *agent, request, {});
  return {};
}

const RobotMotion* Simulation::robot_motion(const std::string& name) const {
  const Agent* agent = state_->find(name);
  return agent && agent->robot ? &agent->robot->motion() : nullptr;
}

void Simulation::teleop(const std::string& agent, const Twist2& twist) {
  Agent* driven = state_->find(agent);
  if (!driven || !finite(twist)) return;
  driven->teleop = twist;
  driven->teleop_until = now() + seconds(0.5);
}

}  // namespace parhelion
