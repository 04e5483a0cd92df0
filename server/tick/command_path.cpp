// The instructor's and the trainee's commands: agents appear and go, TELEOP becomes MR_CMD, only ever reduced
// (promise 3).
#include <algorithm>

#include "server/tick/agent_cameras.hpp"
#include "server/tick/emergency_stop.hpp"
#include "server/tick/sensor_path.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::tick {
namespace {

constexpr Duration repeat =
    milliseconds(100);  // how often a stop is said again: a command may be lost on its way

/// What TELEOP, the newest and as old as it is, allows now.
simulation::VirtualContactResult limit_now(const Configuration& configuration, SimulationTime now,
                                           State& state) {
  simulation::VirtualContactInput input;
  input.teleop = state.teleop;
  input.teleop_age = now - simulation_time(state.teleop_arrival);
  input.pose_known = state.real.has_value();
  input.emergency_stop = state.emergency_stop;
  if (state.teleop && state.real) {
    const Twist2& twist = state.teleop->twist;
    const double lookahead =
        simulation::contact_lookahead(configuration.scenario.contact, configuration.robot, twist);
    // What is simulated itself is held back by the physics.
    if (simulates_trainee(configuration.scenario)) {
      input.clearance.distance = lookahead;
      return simulation::limit(configuration.scenario.contact, configuration.robot, input, state.contact);
    }
    input.clearance = state.simulation.clearance(state.real->T_map_base, twist, lookahead);
  }
  return simulation::limit(configuration.scenario.contact, configuration.robot, input, state.contact);
}

void note_hold(const Configuration& configuration, SimulationTime now, simulation::HoldReason reason,
               State& state, Outputs& outputs) {
  if (reason == state.held) return;
  state.held = reason;
  Event event;
  event.stamp = now;
  event.kind =
      reason == simulation::HoldReason::none ? EventKind::command_restored : EventKind::command_reduced;
  event.subject = configuration.robot.name;
  event.pair = PairKind::real_virtual;
  event.text = to_string(reason);
  publish_event(configuration, event, state, outputs);
}

void send_command(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs) {
  const simulation::VirtualContactResult result = limit_now(configuration, now, state);
  state.last_command = now;
  encode(result.command, outputs.add(configuration.channels.bus(channel::mr_cmd)));
  if (simulates_trainee(configuration.scenario))
    state.simulation.teleop(configuration.robot.name, result.command.twist);
  // Consoles are silent when they have stopped: that holds nothing back.
  const bool stopped = result.reason == simulation::HoldReason::silence &&
                       simulation::footprint_speed(configuration.robot, state.teleop->twist) == 0;
  note_hold(configuration, now, stopped ? simulation::HoldReason::none : result.reason, state, outputs);
}

/// A stop of what was asked for last: no velocity, no effort, and the position where the encoders say that
/// the joints are. Where they do not, no position: none is made up.
Joints joint_stop(const Configuration& configuration, SimulationTime now, const State& state) {
  Joints stop = state.joint_command;
  stop.stamp = {now.ns};
  stop.velocities.assign(stop.names.size(), 0.0);
  std::fill(stop.efforts.begin(), stop.efforts.end(), 0.0);
  for (std::size_t i = 0; i < stop.positions.size(); ++i) {
    const auto measured = state.joint_positions.find(stop.names[i]);
    const bool fresh = measured != state.joint_positions.end() &&
                       (now - measured->second.second).seconds() < configuration.scenario.contact.silence;
    if (!fresh) {
      stop.positions.clear();
      break;
    }
    stop.positions[i] = measured->second.first;
  }
  return stop;
}

constexpr Duration just_before =
    seconds(1.0);  // of a silence: consoles say for as long that they have stopped

void say_dead_man(const Configuration& configuration, SimulationTime now, EventKind kind, double value,
                  State& state, Outputs& outputs) {
  state.dead_man.pressed = kind == EventKind::deadman_pressed;
  Event event;
  event.stamp = now;
  event.kind = kind;
  event.subject = configuration.robot.name;
  event.value = value;
  publish_event(configuration, event, state, outputs);
}

/// TELEOP says nothing of the switch but by coming: consoles are silent while it is released.
void hear_dead_man(const Configuration& configuration, ArrivalTime arrival, const Twist2& twist, State& state,
                   Outputs& outputs) {
  DeadMan& dead_man = state.dead_man;
  dead_man.heard = arrival;
  const double speed = simulation::footprint_speed(configuration.robot, twist);
  if (speed > 0) {
    dead_man.moved = arrival;
    dead_man.speed = speed;
  }
  // A stop that nothing came before is no beginning.
  if (!dead_man.pressed && speed > 0)
    say_dead_man(configuration, simulation_time(arrival), EventKind::deadman_pressed, 0, state, outputs);
}

void watch_dead_man(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs) {
  const DeadMan& dead_man = state.dead_man;
  if (!dead_man.pressed) return;
  if ((now - simulation_time(dead_man.heard)).seconds() < configuration.scenario.contact.silence) return;
  const bool moving = dead_man.moved && dead_man.heard - *dead_man.moved <= just_before;
  say_dead_man(configuration, now, EventKind::deadman_released, moving ? dead_man.speed : 0, state, outputs);
}

/// m between the place that was said and where that thing is now; -1: no place was said, or there is no such
/// thing.
double report_error(const Configuration& configuration, const AgentCommand& command, const State& state) {
  if (command.action != AgentCommand::Action::report_at) return -1;
  const Eigen::Vector3d said = command.agent.T_map_base.translation();
  const auto off = [&](const Eigen::Vector3d& place) { return (place - said).head<2>().norm(); };
  if (const auto pose = state.simulation.pose_of(command.agent.name)) return off(pose->translation());
  for (const ModelEntity& entity : (state.model ? *state.model : configuration.model).entities) {
    if (entity.name == command.agent.name) return off(entity.T_map_body.translation());
  }
  return -1;
}

/// Right or wrong, the trainee's word is an event.
void take_report(const Configuration& configuration, const AgentCommand& command, SimulationTime now,
                 State& state, Outputs& outputs) {
  Event event;
  event.stamp = now;
  event.kind = EventKind::object_reported;
  event.subject = configuration.robot.name;
  event.object = command.agent.name;
  event.request = command.request;
  event.value = report_error(configuration, command, state);
  if (command.action == AgentCommand::Action::report_at)
    event.position = command.agent.T_map_base.translation();
  publish_event(configuration, event, state, outputs);
}

/// What is about agents, or about the session that they are in.
Status do_command(const Configuration& configuration, const AgentCommand& command, SimulationTime now,
                  State& state, Outputs& outputs) {
  switch (command.action) {
    case AgentCommand::Action::script:
      return state.scripts.set_off(command.agent.name, now);
    case AgentCommand::Action::lesson:
    case AgentCommand::Action::lesson_over:
      return teach(configuration, command, now, state);
    default:
      return do_agent_command(configuration, command, state, outputs);
  }
}

/// What the operator says does not arrive at a simulated robot that is out of radio range: its silence stops
/// it.
bool is_heard(const Configuration& configuration, const State& state) {
  return !simulates_trainee(configuration.scenario) ||
         !state.simulation.supply_of(configuration.robot.name).radio_lost;
}

/// A simulated robot obeys what goes out, as a real one does.
void send_joint_command(const Configuration& configuration, SimulationTime now, const Joints& command,
                        State& state, Outputs& outputs) {
  state.last_joint_command = now;
  encode(command, outputs.add(configuration.channels.bus(channel::mr_joint_cmd)));
  const std::string& robot = configuration.robot.name;
  if (!simulates_trainee(configuration.scenario) || state.simulation.supply_of(robot).battery_empty) return;
  const Status done = state.simulation.joint_command(robot, command);
  if (!done) refuse({configuration.channels.bus(channel::joint_cmd) + ": " + done.error().message}, state);
}

bool moves_nothing(const Joints& command) {
  const auto is_zero = [](double value) { return value == 0; };
  return command.positions.empty() &&
         std::all_of(command.velocities.begin(), command.velocities.end(), is_zero) &&
         std::all_of(command.efforts.begin(), command.efforts.end(), is_zero);
}

void stop_joints(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs) {
  send_joint_command(configuration, now, joint_stop(configuration, now, state), state, outputs);
}

/// No command goes out but the stop. What moves joints is held as well, until whoever moves them has let go.
Status stop_or_let_go(const Configuration& configuration, const AgentCommand& command, SimulationTime now,
                      State& state, Outputs& outputs) {
  state.emergency_stop = command.action == AgentCommand::Action::freeze;
  state.joints_stopped = state.joints_stopped || state.emergency_stop;
  if (state.teleop) send_command(configuration, now, state, outputs);
  if (state.emergency_stop && !state.joint_command.names.empty())
    stop_joints(configuration, now, state, outputs);
  // Freezing all froze a simulated one as it froze the agents.
  if (state.emergency_stop || !simulates_trainee(configuration.scenario)) return {};
  return state.simulation.command(command, std::nullopt);
}

/// An agent's camera begins to send pictures, or ends.
Status do_camera_command(const Configuration& configuration, const AgentCommand& command, State& state) {
  const std::string& name = command.agent.name;
  if (name == configuration.robot.name)
    return Error{"'" + name + "' is the trainee's robot: its camera's pictures are " +
                 configuration.channels.bus(channel::mr_camera)};
  const AgentDefinition* known = state.simulation.find_agent(name);
  if (known == nullptr) return Error{"no agent is called '" + name + "'"};
  AgentDefinition agent = *known;
  agent.camera_rate = command.agent.T_map_base.translation().x();
  return set_agent_camera(configuration, agent, state);
}

/// What must not appear on the trainee's robot is checked against where that is, simulated or real; itself
/// excepted.
std::optional<simulation::RealRobotState> robot_in_the_way(const Configuration& configuration,
                                                           const AgentCommand& command, const State& state) {
  if (!simulates_trainee(configuration.scenario)) return state.real;
  if (command.agent.name == configuration.robot.name) return std::nullopt;
  return trainee_state(configuration, state);
}

}  // namespace

Status do_agent_command(const Configuration& configuration, const AgentCommand& command, State& state,
                        Outputs& outputs) {
  using Action = AgentCommand::Action;
  if (command.action == Action::camera) return do_camera_command(configuration, command, state);
  const bool spawns = command.action == Action::spawn;
  if (spawns) {
    if (Status fits = check_agent_camera(configuration, command.agent, state); !fits) return fits;
  }
  Status done = state.simulation.command(command, robot_in_the_way(configuration, command, state));
  if (done.ok() && spawns) {
    state.kinds[command.agent.name] = command.agent.kind;
    if (command.agent.camera_rate > 0) done = set_agent_camera(configuration, command.agent, state);
  }
  forget_agent_cameras(state);
  publish_simulation_events(configuration, state, outputs);
  return done;
}

void answer_agent_command(const Configuration& configuration, const Message& input, State& state,
                          Outputs& outputs) {
  AgentCommand command;
  const Status read = decode(input.channel, input.payload, command);
  if (!read) refuse(read.error(), state);
  if (!read && command.request == 0) return;  // nobody to answer
  const bool report = read.ok() && (command.action == AgentCommand::Action::report ||
                                    command.action == AgentCommand::Action::report_at);
  if (report) take_report(configuration, command, simulation_time(input.arrival), state, outputs);
  const bool stop = read.ok() && is_emergency_stop(configuration, command);
  const Status done =
      stop ? stop_or_let_go(configuration, command, simulation_time(input.arrival), state, outputs)
      : read.ok() && !report
          ? do_command(configuration, command, simulation_time(input.arrival), state, outputs)
          : read;
  if (!read) command.agent = {};  // what could not be read is not repeated
  Event answer;
  answer.stamp = simulation_time(input.arrival);
  answer.kind = done.ok() ? EventKind::command_accepted : EventKind::command_refused;
  answer.subject = command.agent.name;
  answer.request = command.request;
  answer.position = command.agent.T_map_base.translation();
  if (!done.ok()) answer.text = done.error().message;
  publish_event(configuration, answer, state, outputs);
}

void answer_teleop(const Configuration& configuration, const Message& input, State& state, Outputs& outputs) {
  TwistCommand command;
  if (const Status read = decode(input.channel, input.payload, command); !read) {
    refuse(read.error(), state);
    command = {};  // a command that cannot be read is a stop
  }
  hear_dead_man(configuration, input.arrival, command.twist, state, outputs);
  if (!is_heard(configuration, state)) return;
  state.teleop = command;
  state.teleop_arrival = input.arrival;
  send_command(configuration, simulation_time(input.arrival), state, outputs);
}

void stop_robot(const Configuration& configuration, const std::string& robot, ArrivalTime now, State& state,
                Outputs& outputs) {
  if (robot != configuration.robot.name) return state.simulation.teleop(robot, {});
  if (!state.teleop) return;  // nobody has moved it
  state.teleop = TwistCommand{{now.ns}, {}};
  state.teleop_arrival = now;
  send_command(configuration, simulation_time(now), state, outputs);
  if (!state.joint_command.names.empty()) stop_joints(configuration, simulation_time(now), state, outputs);
}

void watch_silence(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs) {
  watch_dead_man(configuration, now, state, outputs);
  const auto silent = [&](ArrivalTime last, SimulationTime said) {
    return now - said >= repeat &&
           (now - simulation_time(last)).seconds() >= configuration.scenario.contact.silence;
  };
  if (state.teleop && silent(state.teleop_arrival, state.last_command))
    send_command(configuration, now, state, outputs);
  if (!state.joint_command.names.empty() && silent(state.joint_command_arrival, state.last_joint_command))
    stop_joints(configuration, now, state, outputs);
}

/// Joints have no virtual contact: a command passes as it is, and stops when it is not renewed. After an
/// emergency stop none passes before somebody has let go: a command that moves nothing, or silence.
void answer_joint_command(const Configuration& configuration, const Message& input, State& state,
                          Outputs& outputs) {
  const SimulationTime now = simulation_time(input.arrival);
  Joints command;
  if (const Status read = decode(input.channel, input.payload, command); !read) {
    refuse(read.error(), state);
    // A command that cannot be read is a stop of what moves.
    if (!state.joint_command.names.empty()) stop_joints(configuration, now, state, outputs);
    return;
  }
  if (!is_heard(configuration, state)) return;
  const bool silent = (now - simulation_time(state.joint_command_arrival)).seconds() >=
                      configuration.scenario.contact.silence;
  const bool let_go = silent || moves_nothing(command);
  state.joints_stopped = state.emergency_stop || (state.joints_stopped && !let_go);
  state.joint_command = std::move(command);
  state.joint_command_arrival = input.arrival;
  if (state.joints_stopped) return stop_joints(configuration, now, state, outputs);
  send_joint_command(configuration, now, state.joint_command, state, outputs);
}

void drive_agent(const Configuration& configuration, const Message& input, std::string_view agent,
                 State& state) {
  if (simulates_trainee(configuration.scenario) && agent == configuration.robot.name)
    return refuse({input.channel + ": this is the trainee's robot; send " +
                   configuration.channels.bus(channel::teleop)},
                  state);
  TwistCommand command;
  if (const Status read = decode(input.channel, input.payload, command); !read)
    return refuse(read.error(), state);
  state.simulation.teleop(std::string(agent), command.twist);
}

}  // namespace parhelion::tick
