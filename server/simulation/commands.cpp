#include <algorithm>
#include <cmath>

#include "protocols/nearest_name.hpp"
#include "server/simulation/state.hpp"

namespace parhelion::simulation {
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
  std::vector<std::string> names;
  for (const auto& agent : agents) names.push_back(agent->definition.name);
  if (names.empty()) return Error{"no agent '" + name + "': there are none; spawn it first"};
  return Error{"no agent '" + name + "'" + suggestion_or_known(name, names)};
}

/// Puts the agent there: a new epoch, nothing in between.
void Simulation::State::put(Agent& agent, const Pose2& pose) {
  ++agent.epoch;
  set_coasting(agent, false);
  agent.floor = building->floor_height(pose.position());
  const auto T_map_body = Transform<Map, Body>::planar(pose.x, pose.y, pose.yaw, agent.floor);
  if (agent.robot) {
    agent.robot->put(physics, Transform<Map, Base>(T_map_body.isometry()));
  } else if (agent.cable) {
    agent.cable->put(physics, Transform<Map, Base>(T_map_body.isometry()));
  } else {
    physics.teleport(agent.handle, T_map_body);
  }
  agent.rigid = {T_map_body, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  agent.pose = pose;
  place(agent.form.footprint, pose, agent.placed);
  wake_near(agent.placed);
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
  agent->turn = next_turn++;
  next_body += static_cast<BodyId>(bodies.size());
  for (const BodyDefinition& body : bodies)
    agent_definitions.push_back(std::make_shared<const BodyDefinition>(body));
  const AgentForm& form = agent->form;
  if (agent->robot) {
    agent->robot->enter(physics, definition.T_map_base);
    agent->handle = agent->robot->base();
  } else if (definition.kind == AgentKind::cable) {
    agent->cable = std::make_unique<Cable>(definition.size);
    agent->cable->enter(physics);
    agent->handle = agent->cable->middle();
  } else {
    agent->handle = form.upright           ? physics.add_upright(form.shape, form.size, form.mass, {})
                    : !form.pieces.empty() ? physics.add_free(form.pieces, form.mass, {})
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

void Simulation::State::remove(std::size_t index, std::uint64_t request) {
  const std::unique_ptr<Agent> agent = std::move(agents[index]);
  agents.erase(agents.begin() + static_cast<std::ptrdiff_t>(index));
  contacts.forget(agent->definition.name, stamp_of(step), events);
  agent->watch.close(stamp_of(step), options.zones, events);
  forget_route(*agent);
  if (agent->robot) {
    agent->robot->leave(physics);
  } else if (agent->cable) {
    agent->cable->leave(physics);
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

Status Simulation::State::apply(const AgentSpawn& command, const std::optional<RealRobotState>& now) {
  return spawn(command.agent, now, command.request);
}

Status Simulation::State::apply(const AgentMove& command, const std::optional<RealRobotState>& now) {
  Agent* agent = find(command.agent);
  if (!agent) return unknown(command.agent);
  AgentDefinition moved = agent->definition;
  moved.T_map_base = command.T_map_base;
  if (Status status = check_place(moved, agent, now); !status) return status;
  agent->definition = moved;
  put(*agent, planar_pose(moved.T_map_base));
  say(EventKind::agent_moved, *agent, command.request, {});
  return {};
}

Status Simulation::State::apply(const AgentBehaviour& command) {
  Agent* agent = find(command.agent);
  if (!agent) return unknown(command.agent);
  AgentDefinition changed = agent->definition;
  changed.behaviour = command.behaviour;
  if (Status status = check_behaviour(changed); !status) return status;
  const std::string& target = changed.behaviour.target;
  if (!target.empty() && target != real.name && !find(target)) return unknown(target);
  agent->definition = changed;
  agent->steering = {};
  agent->steering.heading = agent->pose.yaw;
  forget_route(*agent);
  return {};
}

Status Simulation::State::apply(const AgentRemove& command) {
  if (command.all) {
    for (std::size_t i = agents.size(); i-- > 0;) {
      if (!agents[i]->trainee) remove(i, command.request);
    }
    return {};
  }
  const Agent* agent = find(command.agent);
  if (!agent) return unknown(command.agent);
  if (agent->trainee)
    return Error{"'" + command.agent + "' is the trainee's robot: it can be moved, not removed"};
  const auto at =
      std::find_if(agents.begin(), agents.end(), [&](const auto& each) { return each.get() == agent; });
  remove(static_cast<std::size_t>(at - agents.begin()), command.request);
  return {};
}

Status Simulation::State::apply(const AgentFreeze& command) {
  if (command.all) {
    for (const auto& each : agents) each->frozen = command.frozen;
    return {};
  }
  Agent* agent = find(command.agent);
  if (!agent) return unknown(command.agent);
  agent->frozen = command.frozen;
  return {};
}

Status Simulation::command(const AgentCommand& command, const std::optional<RealRobotState>& real) {
  const auto apply = [&](const auto& each) {
    if constexpr (requires { state_->apply(each, real); }) {
      return state_->apply(each, real);
    } else {
      return state_->apply(each);
    }
  };
  return std::visit(apply, command);
}

Status Simulation::set_door(const DoorCommand& command) { return state_->set_door(command); }

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
  if (agent->supply.empty) return Error{"agent '" + name + "' has an empty battery"};
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
  if (!driven || !finite(twist) || driven->supply.radio_lost) return;
  driven->teleop = twist;
  driven->teleop_until = now() + seconds(0.5);
}

void Simulation::block_sides(const std::string& agent, bool left, bool right) {
  Agent* found = state_->find(agent);
  if (found && found->robot) found->robot->block_sides(left, right);
}

}  // namespace parhelion::simulation
