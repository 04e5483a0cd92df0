// The instructor's and the trainee's commands: agents appear and go, TELEOP becomes MR_CMD, only ever reduced (promise 3).
#include "server/tick.hpp"

namespace parhelion {
namespace {

constexpr double clearance_limit = 10;  // m, further away nothing is in the way of any robot

/// What the twist would run into, where the pose is known well enough to say.
std::optional<Simulation::Clearance> clearance_for(const Twist2& twist, const State& state) {
  if (!state.real) return std::nullopt;
  return state.simulation.clearance(state.real->T_map_base, twist, clearance_limit);
}

void send_command(const Configuration& configuration, SensorTime stamp, const Twist2& twist, Outputs& outputs) {
  encode(TwistCommand{stamp, twist}, outputs.add(configuration.channels.bus(channel::mr_cmd)));
}

void note_reduction(const Configuration& configuration, SimulationTime now, bool reduced, const std::string& agent,
                    State& state, Outputs& outputs) {
  if (reduced == state.command_reduced) return;
  state.command_reduced = reduced;
  Event event;
  event.stamp = now;
  event.kind = reduced ? EventKind::command_reduced : EventKind::command_restored;
  event.subject = configuration.robot.name;
  event.object = agent;
  event.pair = PairKind::real_virtual;
  publish_event(configuration, event, state, outputs);
}

}  // namespace

void answer_agent_command(const Configuration& configuration, const Message& input, State& state, Outputs& outputs) {
  AgentCommand command;
  if (const Status read = decode(input.channel, input.payload, command); !read) return refuse(read.error(), state);
  const Status done = state.simulation.command(command, state.real);
  if (done.ok() && command.action == AgentCommand::Action::spawn) state.kinds[command.agent.name] = command.agent.kind;
  publish_simulation_events(configuration, state, outputs);
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
  if (const Status read = decode(input.channel, input.payload, command); !read) return refuse(read.error(), state);
  const auto clearance = clearance_for(command.twist, state);
  const Twist2 given = limit(configuration, command.twist, simulation_time(input.arrival), clearance, state);
  send_command(configuration, command.stamp, given, outputs);
  const bool reduced = std::abs(given.vx) < std::abs(command.twist.vx) || std::abs(given.wz) < std::abs(command.twist.wz);
  note_reduction(configuration, simulation_time(input.arrival), reduced, clearance ? clearance->agent : "", state, outputs);
}

void drive_agent(const Message& input, std::string_view agent, State& state) {
  TwistCommand command;
  if (const Status read = decode(input.channel, input.payload, command); !read) return refuse(read.error(), state);
  state.simulation.teleop(std::string(agent), command.twist);
}

}  // namespace parhelion
