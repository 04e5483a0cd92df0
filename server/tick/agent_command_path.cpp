#include "server/tick/agent_command_path.hpp"

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/tick/emergency_stop.hpp"
#include "server/tick/sensor_path.hpp"

namespace parhelion::tick {
namespace {

/// m between the reported place and where that thing is now; -1: no place was reported, or there is no such
/// thing.
double report_error(const Configuration& configuration, const AgentCommand& command,
                    const AgentCommandPath& path) {
  if (command.action != AgentCommand::Action::report_at) return -1;
  const Eigen::Vector3d reported = command.agent.T_map_base.translation();
  const auto off = [&](const Eigen::Vector3d& place) { return (place - reported).head<2>().norm(); };
  if (const auto pose = path.agents.simulation.pose_of(command.agent.name)) return off(pose->translation());
  for (const ModelEntity& entity : current_model(configuration, path.site).entities) {
    if (entity.name == command.agent.name) return off(entity.T_map_body.translation());
  }
  return -1;
}

/// Right or wrong, the trainee's report is an event.
void handle_object_report(const TickContext& context, const AgentCommand& command,
                          const AgentCommandPath& path) {
  Event event;
  event.stamp = context.now;
  event.kind = EventKind::object_reported;
  event.subject = context.configuration.robot.name;
  event.object = command.agent.name;
  event.request = command.request;
  event.value = report_error(context.configuration, command, path);
  if (command.action == AgentCommand::Action::report_at)
    event.position = command.agent.T_map_base.translation();
  publish_event(context, event);
}

Status handle_emergency_stop(const TickContext& context, const AgentCommand& command,
                             const AgentCommandPath& path) {
  const bool stopped = command.action == AgentCommand::Action::freeze;
  set_emergency_stop(context, stopped, path.robot);
  // Freezing all froze a simulated one as it froze the agents.
  if (stopped || !simulates_trainee(context.configuration.scenario)) return {};
  return path.agents.simulation.command(command, std::nullopt);
}

/// An agent's camera begins to send pictures, or ends.
Status apply_camera_command(const TickContext& context, const AgentCommand& command, const AgentPath& path) {
  const Configuration& configuration = context.configuration;
  const std::string& name = command.agent.name;
  if (name == configuration.robot.name)
    return Error{"'" + name + "' is the trainee's robot: its camera's pictures are " +
                 configuration.channels.bus(channel::mr_camera)};
  const AgentDefinition* known = path.simulation.find_agent(name);
  if (known == nullptr) return Error{"no agent is called '" + name + "'"};
  AgentDefinition agent = *known;
  agent.camera_rate = command.agent.T_map_base.translation().x();
  return set_agent_camera(configuration, agent, path.simulation.now(), path.cameras);
}

/// What must not appear on the trainee's robot is checked against where that is, simulated or real; itself
/// excepted.
std::optional<simulation::RealRobotState> robot_in_the_way(const Configuration& configuration,
                                                           const AgentCommand& command,
                                                           const AgentPath& path) {
  if (!simulates_trainee(configuration.scenario)) return path.pose.at_step;
  if (command.agent.name == configuration.robot.name) return std::nullopt;
  return trainee_state(configuration, path.simulation);
}

Status apply_command(const TickContext& context, const AgentCommand& command, const AgentCommandPath& path) {
  if (is_emergency_stop(context.configuration, command)) return handle_emergency_stop(context, command, path);
  switch (command.action) {
    case AgentCommand::Action::report:
    case AgentCommand::Action::report_at:
      handle_object_report(context, command, path);
      return {};
    case AgentCommand::Action::script:
      return path.scripts.set_off(command.agent.name, context.now);
    case AgentCommand::Action::lesson:
    case AgentCommand::Action::lesson_over:
      return process_fault_command(context, command, path.faults);
    default:
      return apply_agent_command(context, command, path.agents);
  }
}

}  // namespace

Status apply_agent_command(const TickContext& context, const AgentCommand& command, const AgentPath& path) {
  using Action = AgentCommand::Action;
  if (command.action == Action::camera) return apply_camera_command(context, command, path);
  const bool spawns = command.action == Action::spawn;
  if (spawns) {
    const Status fits = check_agent_camera(context.configuration, command.agent, path.cameras);
    if (!fits) return fits;
  }
  Status done = path.simulation.command(command, robot_in_the_way(context.configuration, command, path));
  if (done.ok() && spawns) {
    path.kinds[command.agent.name] = command.agent.kind;
    if (command.agent.camera_rate > 0)
      done = set_agent_camera(context.configuration, command.agent, path.simulation.now(), path.cameras);
  }
  forget_agent_cameras(path.simulation, path.cameras);
  publish_simulation_events(context, path.simulation);
  return done;
}

void handle_agent_command(const TickContext& context, const Message& input, const AgentCommandPath& path) {
  AgentCommand command;
  const Status read = decode(input.channel, input.payload, command);
  if (!read) refuse(context, read.error());
  if (!read && command.request == 0) return;  // nobody to answer
  const Status done = read ? apply_command(context, command, path) : read;
  if (!read) command.agent = {};  // what could not be read is not repeated
  Event answer;
  answer.stamp = context.now;
  answer.kind = done.ok() ? EventKind::command_accepted : EventKind::command_refused;
  answer.subject = command.agent.name;
  answer.request = command.request;
  answer.position = command.agent.T_map_base.translation();
  if (!done.ok()) answer.text = done.error().message;
  publish_event(context, answer);
}

}  // namespace parhelion::tick
