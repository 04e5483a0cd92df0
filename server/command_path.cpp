// The instructor's and the trainee's commands: agents appear and go, TELEOP becomes MR_CMD, only ever reduced
// (promise 3).
#include "server/tick.hpp"

namespace parhelion {
namespace {

constexpr Duration repeat =
    milliseconds(100);  // how often a stop is said again: a command may be lost on its way

/// What TELEOP, the newest and as old as it is, allows now.
VirtualContactResult limit_now(const Configuration& configuration, SimulationTime now, State& state) {
  VirtualContactInput input;
  input.teleop = state.teleop;
  input.teleop_age = now - simulation_time(state.teleop_arrival);
  input.pose_known = state.real.has_value();
  if (state.teleop && state.real) {
    const Twist2& twist = state.teleop->twist;
    const double lookahead = contact_lookahead(configuration.scenario.contact, configuration.robot, twist);
    input.clearance = state.simulation.clearance(state.real->T_map_base, twist, lookahead);
  }
  return limit(configuration.scenario.contact, configuration.robot, input, state.contact);
}

void note_hold(const Configuration& configuration, SimulationTime now, HoldReason reason, State& state,
               Outputs& outputs) {
  if (reason == state.held) return;
  state.held = reason;
  Event event;
  event.stamp = now;
  event.kind = reason == HoldReason::none ? EventKind::command_restored : EventKind::command_reduced;
  event.subject = configuration.robot.name;
  event.pair = PairKind::real_virtual;
  event.text = to_string(reason);
  publish_event(configuration, event, state, outputs);
}

void send_command(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs) {
  const VirtualContactResult result = limit_now(configuration, now, state);
  state.last_command = now;
  encode(result.command, outputs.add(configuration.channels.bus(channel::mr_cmd)));
  note_hold(configuration, now, result.reason, state, outputs);
}

}  // namespace

void answer_agent_command(const Configuration& configuration, const Message& input, State& state,
                          Outputs& outputs) {
  AgentCommand command;
  const Status read = decode(input.channel, input.payload, command);
  if (!read) refuse(read.error(), state);
  if (!read && command.request == 0) return;  // nobody to answer
  const Status done = read.ok() ? state.simulation.command(command, state.real) : read;
  if (done.ok() && command.action == AgentCommand::Action::spawn)
    state.kinds[command.agent.name] = command.agent.kind;
  publish_simulation_events(configuration, state, outputs);
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
  state.teleop = command;
  state.teleop_arrival = input.arrival;
  send_command(configuration, simulation_time(input.arrival), state, outputs);
}

void watch_silence(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs) {
  if (!state.teleop || now - state.last_command < repeat) return;
  const bool silent =
      (now - simulation_time(state.teleop_arrival)).seconds() >= configuration.scenario.contact.silence;
  if (silent) send_command(configuration, now, state, outputs);
}

void drive_agent(const Message& input, std::string_view agent, State& state) {
  TwistCommand command;
  if (const Status read = decode(input.channel, input.payload, command); !read)
    return refuse(read.error(), state);
  state.simulation.teleop(std::string(agent), command.twist);
}

}  // namespace parhelion
