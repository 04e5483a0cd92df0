// The trainee's commands: TELEOP becomes MR_CMD, only ever reduced (promise 3).
#include <algorithm>

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

}  // namespace

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

void set_emergency_stop(const Configuration& configuration, bool engaged, SimulationTime now, State& state,
                        Outputs& outputs) {
  state.emergency_stop = engaged;
  state.joints_stopped = state.joints_stopped || engaged;
  if (state.teleop) send_command(configuration, now, state, outputs);
  if (engaged && !state.joint_command.names.empty()) stop_joints(configuration, now, state, outputs);
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
