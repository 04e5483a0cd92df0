// Commands to agents, simulated robots and doors (part of Simulation).
#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "protocols/driving_timing.hpp"
#include "protocols/hash.hpp"
#include "server/simulation/agent_lasers.hpp"
#include "server/simulation/behaviour/admission.hpp"
#include "server/simulation/behaviour/wandering.hpp"
#include "server/simulation/bodies/bodies.hpp"
#include "server/simulation/bodies/movable_objects.hpp"
#include "server/simulation/parts.hpp"
#include "server/simulation/robots/base_body.hpp"
#include "server/simulation/world/free_place.hpp"

namespace parhelion::simulation {

void Simulation::Parts::put(Agent& agent, const Pose2& pose, std::optional<double> bottom) {
  ++agent.epoch;
  set_unconstrained(agent, false, physics);
  agent.floor = environment.building->floor_height(pose.position());
  const auto T_map_body =
      Transform<Map, Body>::planar(pose.x, pose.y, pose.yaw, bottom.value_or(agent.floor));
  if (agent.robot) {
    agent.robot->put(physics, base_of(T_map_body));
  } else if (agent.cable) {
    agent.cable->put(physics, base_of(T_map_body));
  } else {
    physics.teleport(agent.handle, T_map_body);
  }
  agent.rigid = {T_map_body, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  agent.pose = pose;
  place(agent.form.footprint, pose, agent.placed);
  constrain_near(agent.placed, agents, physics);
  agent.driven = {};
  agent.steering = {};
  agent.steering.heading = pose.yaw;
  behaviours.forget_route(agent);
  if (agent.laser) agent.laser->measured.reset();
  contacts.forget(agent.definition.name, clock.now(), events);
}

void Simulation::Parts::enter_physics(Agent& agent) {
  const AgentForm& form = agent.form;
  if (agent.robot) {
    agent.robot->enter(physics, agent.definition.T_map_base);
    agent.handle = agent.robot->base();
  } else if (agent.definition.kind == AgentKind::cable) {
    agent.cable = std::make_unique<Cable>(agent.definition.size);
    agent.cable->enter(physics);
    agent.handle = agent.cable->middle();
  } else {
    agent.handle = form.upright           ? physics.add_upright(form.shape, form.size, form.mass, {})
                   : !form.pieces.empty() ? physics.add_free(form.pieces, form.mass, {})
                                          : physics.add_free(form.shape, form.size, form.mass, {});
  }
}

Status Simulation::Parts::spawn(const AgentDefinition& definition, RealRobotStates states,
                                std::uint64_t request, bool trainee) {
  if (Status status =
          check_definition(definition, trainee, options, *environment.building, agents, real_robots);
      !status)
    return status;
  auto agent = std::make_unique<Agent>();
  agent->definition = definition;
  agent->form = form_of(definition, options);
  if (Status status = check_place(definition, agent->form, nullptr, environment, agents, real_robots, states);
      !status)
    return status;
  agent->trainee = trainee;
  agent->seen_by.resize(real_robots.size());
  if (!definition.model.empty())
    agent->robot = std::make_unique<ArticulatedRobot>(find_model(definition.model, options));
  agent->name_hash = fnv1a(definition.name);
  agent->random_stream = random_stream(options.seed, agent->name_hash);
  if (Status status = fit_laser(*agent, clock.now()); !status) return status;
  const BodyOwner owner = trainee ? BodyOwner::real_robot : BodyOwner::agent;
  const BodyId first = agents.next_body();
  const auto bodies =
      agent->robot ? agent->robot->bodies(definition.name, first, owner) : agent_bodies(definition, first);
  agent->first_body = agents.take_body_numbers(bodies.size());
  agent->body_count = bodies.size();
  agent->decision_offset = agents.take_spawn_number();
  enter_physics(*agent);
  agent->watch = BodyWatch(agent->robot ? supervised(definition.name, agent->robot->model())
                                        : supervised(definition, agent->form));
  put(*agent, planar_pose(definition.T_map_base));
  publish(agent_event(EventKind::agent_spawned, *agent, clock.now(), request, to_string(definition.kind)));
  agents.add(std::move(agent), bodies);
  rebuild_scene();
  return {};
}

Status Simulation::Parts::add_object(const ModelObject& object) {
  const std::string who = "movable object '" + object.name + "': ";
  if (!object.T_map_body.finite() || !object.size.allFinite() || object.size.minCoeff() <= 0)
    return Error{who + "expected a finite pose and a size above 0 m"};
  const auto& fixed = environment.building->obstacles();
  const bool taken =
      agents.find(object.name) != nullptr ||
      std::any_of(fixed.begin(), fixed.end(), [&](const FixedObstacle& o) { return o.name == object.name; });
  if (taken) return Error{who + "its name is taken by another part of the site"};
  auto agent = std::make_unique<Agent>();
  agent->definition = object_agent(object);
  agent->form = object_form(object);
  agent->of_site = true;
  agent->seen_by.resize(real_robots.size());
  agent->name_hash = fnv1a(object.name);
  agent->random_stream = random_stream(options.seed, agent->name_hash);
  agent->first_body = agents.take_body_numbers(1);
  agent->body_count = 1;
  agent->decision_offset = agents.take_spawn_number();
  enter_physics(*agent);
  agent->watch = BodyWatch(supervised(agent->definition, agent->form));
  const Transform<Map, Base>& T_map_base = agent->definition.T_map_base;
  put(*agent, planar_pose(T_map_base), T_map_base.translation().z());
  const BodyDefinition body = object_body(object, agent->first_body);
  agents.add(std::move(agent), {body});
  return {};
}

void Simulation::Parts::remove(std::size_t index, std::uint64_t request) {
  const std::unique_ptr<Agent> agent = agents.remove(index);
  contacts.forget(agent->definition.name, clock.now(), events);
  agent->watch.close(clock.now(), options.zones, events);
  behaviours.forget_route(*agent);
  if (agent->robot) {
    agent->robot->leave(physics);
  } else if (agent->cable) {
    agent->cable->leave(physics);
  } else {
    physics.remove(agent->handle);
  }
  publish(agent_event(EventKind::agent_removed, *agent, clock.now(), request));
  rebuild_scene();
}

Status Simulation::Parts::check_target(const Behaviour& behaviour) const {
  const std::string& target = behaviour.target;
  const bool is_real = std::any_of(real_robots.begin(), real_robots.end(),
                                   [&](const RealRobot& robot) { return robot.name == target; });
  return target.empty() || is_real || agents.find(target) ? Status{} : agents.unknown(target);
}

Status Simulation::Parts::apply(const AgentSpawn& command, RealRobotStates states) {
  if (Status known = check_target(command.agent.behaviour); !known) return known;
  return spawn(command.agent, states, command.request);
}

Status Simulation::Parts::apply(const AgentMove& command, RealRobotStates states) {
  Agent* agent = agents.find(command.agent);
  if (!agent) return agents.unknown(command.agent);
  AgentDefinition moved = agent->definition;
  moved.T_map_base = command.T_map_base;
  if (Status status = check_place(moved, agent->form, agent, environment, agents, real_robots, states);
      !status)
    return status;
  agent->definition = moved;
  put(*agent, planar_pose(moved.T_map_base));
  publish(agent_event(EventKind::agent_moved, *agent, clock.now(), command.request));
  return {};
}

Status Simulation::Parts::apply(const AgentBehaviour& command, RealRobotStates) {
  Agent* agent = agents.find(command.agent);
  if (!agent) return agents.unknown(command.agent);
  AgentDefinition changed = agent->definition;
  changed.behaviour = command.behaviour;
  if (Status status = check_behaviour(changed, options, *environment.building); !status) return status;
  if (Status known = check_target(changed.behaviour); !known) return known;
  agent->definition = changed;
  agent->steering = {};
  agent->steering.heading = agent->pose.yaw;
  behaviours.forget_route(*agent);
  return {};
}

Status Simulation::Parts::apply(const AgentRemove& command, RealRobotStates) {
  if (command.all) {
    for (std::size_t i = agents.size(); i-- > 0;) {
      if (!agents[i].trainee && !agents[i].of_site) remove(i, command.request);
    }
    return {};
  }
  const Agent* agent = agents.find(command.agent);
  if (!agent) return agents.unknown(command.agent);
  if (agent->trainee)
    return Error{"'" + command.agent + "' is the trainee's robot: it can be moved, not removed"};
  remove(agents.index_of(*agent), command.request);
  return {};
}

Status Simulation::Parts::apply(const AgentFreeze& command, RealRobotStates) {
  if (command.all) {
    for (Agent& agent : agents) agent.frozen = command.frozen;
    return {};
  }
  Agent* agent = agents.find(command.agent);
  if (!agent) return agents.unknown(command.agent);
  agent->frozen = command.frozen;
  return {};
}

Status Simulation::spawn_among_robots(const AgentDefinition& agent, RealRobotStates real) {
  assert(real.size() == parts_->real_robots.size());
  return parts_->spawn(agent, real, 0);
}

Status Simulation::spawn(const AgentDefinition& agent, const std::optional<RealRobotState>& real) {
  return spawn_among_robots(agent, RealRobotStates(&real, 1));
}

Status Simulation::command_among_robots(const AgentCommand& command, RealRobotStates real) {
  assert(real.size() == parts_->real_robots.size());
  return std::visit([&](const auto& each) { return parts_->apply(each, real); }, command);
}

Status Simulation::command(const AgentCommand& command, const std::optional<RealRobotState>& real) {
  return command_among_robots(command, RealRobotStates(&real, 1));
}

Status Simulation::set_door(const DoorCommand& command) {
  Environment& environment = parts_->environment;
  return environment.doors.command(command, *environment.building, parts_->agents, parts_->physics);
}

Status Simulation::spawn_trainee(const AgentDefinition& trainee) {
  if (const Agent* agent = parts_->agents.trainee())
    return Error{"'" + agent->definition.name + "' is the trainee's robot already; there is one"};
  if (trainee.model.empty())
    return Error{"the trainee's robot '" + trainee.name + "' needs a robot model to be simulated"};
  AgentDefinition definition = trainee;
  definition.kind = AgentKind::robot;
  definition.behaviour.kind = BehaviourKind::teleop;
  const std::vector<std::optional<RealRobotState>> nowhere(parts_->real_robots.size());
  return parts_->spawn(definition, nowhere, 0, true);
}

Status Simulation::joint_command(const std::string& name, const Joints& joints) {
  Agent* agent = parts_->agents.find(name);
  if (!agent) return parts_->agents.unknown(name);
  if (!agent->robot) return Error{"agent '" + name + "' has no joints that can be commanded"};
  if (agent->supply.empty) return Error{"agent '" + name + "' has an empty battery"};
  return agent->robot->command(joints, now());
}

Status Simulation::restore_joints(const std::string& name, std::uint64_t request) {
  Agent* agent = parts_->agents.find(name);
  if (!agent) return parts_->agents.unknown(name);
  if (!agent->robot) return Error{"agent '" + name + "' has no joints that could be restored"};
  agent->robot->restore(parts_->physics);
  ++agent->epoch;
  parts_->publish(agent_event(EventKind::joints_restored, *agent, now(), request));
  return {};
}

void Simulation::teleop(const std::string& agent, const Twist2& twist) {
  Agent* driven = parts_->agents.find(agent);
  if (!driven || !finite(twist) || driven->supply.radio_lost) return;
  driven->teleop = twist;
  driven->teleop_until = now() + driving_timing::kTeleopSilence;
}

bool Simulation::is_driven(const std::string& name) const {
  const Agent* agent = parts_->agents.find(name);
  if (!agent || agent->definition.behaviour.kind != BehaviourKind::teleop) return false;
  const Twist2& twist = agent->teleop;
  const bool moves = twist.vx != 0 || twist.vy != 0 || twist.wz != 0;
  return moves && agent->teleop_until && now() <= *agent->teleop_until;
}

void Simulation::block_sides(const std::string& agent, bool left, bool right) {
  Agent* found = parts_->agents.find(agent);
  if (found && found->robot) found->robot->block_sides(left, right);
}

}  // namespace parhelion::simulation
