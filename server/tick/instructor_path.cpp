// The instructor's commands: each is done or refused, and answered by an event.
#include <type_traits>

#include "server/tick/agent_cameras.hpp"
#include "server/tick/emergency_stop.hpp"
#include "server/tick/instructor_input.hpp"
#include "server/tick/sensor_path.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::tick {
namespace {

/// m between the place that was reported and where that object is now; -1: no place was reported, or there is
/// no such object.
double report_error(const Configuration& configuration, const ObjectReport& report, const State& state) {
  if (!report.position) return -1;
  const auto off = [&](const Eigen::Vector3d& place) { return (place.head<2>() - *report.position).norm(); };
  if (const auto pose = state.simulation.pose_of(report.object)) return off(pose->translation());
  for (const ModelEntity& entity : (state.model ? *state.model : configuration.model).entities) {
    if (entity.name == report.object) return off(entity.T_map_body.translation());
  }
  return -1;
}

/// Right or wrong, the trainee's report is an event.
void handle_object_report(const Configuration& configuration, const ObjectReport& report, SimulationTime now,
                          State& state, Outputs& outputs) {
  Event event;
  event.stamp = now;
  event.kind = EventKind::object_reported;
  event.subject = configuration.robot.name;
  event.object = report.object;
  event.request = report.request;
  event.value = report_error(configuration, report, state);
  event.position = position_of(report);
  publish_event(configuration, event, state, outputs);
}

/// An agent's camera begins to send pictures, or ends.
Status set_camera_rate(const Configuration& configuration, const CameraRate& command, State& state) {
  const std::string& name = command.agent;
  if (name == configuration.robot.name)
    return Error{"'" + name + "' is the trainee's robot: its camera's pictures are " +
                 configuration.channels.bus(channel::mr_camera)};
  const AgentDefinition* known = state.simulation.find_agent(name);
  if (known == nullptr) return Error{"no agent is called '" + name + "'"};
  AgentDefinition agent = *known;
  agent.camera_rate = command.rate;
  return set_agent_camera(configuration, agent, state);
}

/// What must not appear on the trainee's robot is checked against where that is, simulated or real; itself
/// excepted.
std::optional<simulation::RealRobotState> robot_in_the_way(const Configuration& configuration,
                                                           const AgentCommand& command, const State& state) {
  if (!simulates_trainee(configuration.scenario)) return state.real;
  const auto* move = std::get_if<AgentMove>(&command);
  if (move != nullptr && move->agent == configuration.robot.name) return std::nullopt;
  return trainee_state(configuration, state);
}

/// The trainee's robot is stopped and released by what is meant for it. Where it is simulated, it can be let
/// out of a freeze of all.
Status check_freeze(const Configuration& configuration, const AgentCommand& command) {
  const auto* freeze = std::get_if<AgentFreeze>(&command);
  if (freeze == nullptr || freeze->all || freeze->agent != configuration.robot.name) return {};
  if (!freeze->frozen && simulates_trainee(configuration.scenario)) return {};
  return Error{"'" + freeze->agent + "' is the trainee's robot: it is stopped and released by " +
               configuration.channels.bus(channel::mr_emergency_stop)};
}

/// What an instructor's commands do, one function a type.
struct CommandHandler {
  const Configuration& configuration;
  SimulationTime now;
  State& state;
  Outputs& outputs;

  template <class Command>
  requires std::is_constructible_v<AgentCommand, const Command&> Status operator()(const Command& command) {
    return do_agent_command(configuration, command, state, outputs);
  }
  Status operator()(const DoorCommand& command) {
    Status done = state.simulation.set_door(command);
    publish_simulation_events(configuration, state, outputs);
    return done;
  }
  Status operator()(const FaultCommand& command) {
    return process_fault_command(configuration, command, now, state);
  }
  Status operator()(const CameraRate& command) { return set_camera_rate(configuration, command, state); }
  Status operator()(const ObjectReport& command) {
    handle_object_report(configuration, command, now, state, outputs);
    return {};
  }
  Status operator()(const ScriptStart& command) { return state.scripts.set_off(command.script, now); }
  Status operator()(const EmergencyStopCommand& command) {
    if (is_for_trainee(configuration, command)) {
      set_emergency_stop(configuration, command.engaged, now, state, outputs);
      return {};
    }
    AgentFreeze freeze;
    freeze.request = command.request;
    freeze.agent = command.robot;
    freeze.frozen = command.engaged;
    return do_agent_command(configuration, freeze, state, outputs);
  }
};

}  // namespace

Status do_agent_command(const Configuration& configuration, const AgentCommand& command, State& state,
                        Outputs& outputs) {
  const auto* spawn = std::get_if<AgentSpawn>(&command);
  if (spawn != nullptr) {
    if (Status fits = check_agent_camera(configuration, spawn->agent, state); !fits) return fits;
  }
  if (Status allowed = check_freeze(configuration, command); !allowed) return allowed;
  Status done = state.simulation.command(command, robot_in_the_way(configuration, command, state));
  if (done.ok() && spawn != nullptr) {
    state.kinds[spawn->agent.name] = spawn->agent.kind;
    if (spawn->agent.camera_rate > 0) done = set_agent_camera(configuration, spawn->agent, state);
  }
  forget_agent_cameras(state);
  publish_simulation_events(configuration, state, outputs);
  return done;
}

void process_command(const Configuration& configuration, const Message& input, State& state,
                     Outputs& outputs) {
  InstructorCommand command;
  const SimulationTime now = simulation_time(input.arrival);
  const Status read = read_command(configuration.channels, input, command);
  if (!read) refuse(read.error(), state);
  if (!read && request_of(command) == 0) return;  // nobody to answer
  const Status done = read ? std::visit(CommandHandler{configuration, now, state, outputs}, command) : read;
  Event answer;
  answer.stamp = now;
  answer.kind = done.ok() ? EventKind::command_accepted : EventKind::command_refused;
  answer.request = request_of(command);
  if (read) {  // what could not be read is not repeated
    answer.subject = subject_of(command);
    answer.position = position_of(command);
  }
  if (!done.ok()) answer.text = done.error().message;
  publish_event(configuration, answer, state, outputs);
}

}  // namespace parhelion::tick
