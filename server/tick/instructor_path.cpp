#include "server/tick/instructor_path.hpp"

#include <type_traits>

#include "protocols/channels.hpp"
#include "protocols/driving_timing.hpp"
#include "server/tick/emergency_stop.hpp"
#include "server/tick/instructor_input.hpp"
#include "server/tick/sensor_path.hpp"

namespace parhelion::tick {
namespace {

/// m between the reported and the current position of the object; -1: no position was reported, or no such
/// object exists.
double report_error(const Configuration& configuration, const ObjectReport& report,
                    const InstructorPath& path) {
  if (!report.position) return -1;
  const auto off = [&](const Eigen::Vector3d& place) { return (place.head<2>() - *report.position).norm(); };
  if (const auto pose = path.agents.simulation.pose_of(report.object)) return off(pose->translation());
  for (const ModelEntity& entity : current_model(configuration, path.site).entities) {
    if (entity.name == report.object) return off(entity.T_map_body.translation());
  }
  return -1;
}

/// Publishes an event for each report of the trainee, right or wrong.
void handle_object_report(const TickContext& context, const ObjectReport& report,
                          const InstructorPath& path) {
  Event event;
  event.stamp = context.now;
  event.kind = EventKind::object_reported;
  event.subject = context.robot().name;
  event.object = report.object;
  event.request = report.request;
  event.value = report_error(context.configuration, report, path);
  event.position = position_of(report);
  publish_event(context, event);
}

/// Starts or stops the images of an agent's camera.
Status set_camera_rate(const TickContext& context, const CameraRate& command, const AgentPath& path) {
  const Configuration& configuration = context.configuration;
  const std::string& name = command.agent;
  if (const auto robot = configuration.find_robot(name))
    return Error{"'" + name + "' is the trainee's robot: its camera images are on " +
                 configuration.channels.bus(channel::kMrCamera, *robot)};
  const AgentDefinition* known = path.simulation.find_agent(name);
  if (known == nullptr) return Error{"no agent is called '" + name + "'"};
  AgentDefinition agent = *known;
  agent.camera_rate = command.rate;
  return set_agent_camera(configuration, agent, path.simulation.now(), path.cameras);
}

/// The trainees' robots, simulated or real, as obstacles for placement; none where the command moves this
/// robot itself.
RealRobots robots_to_avoid(const Configuration& configuration, const AgentCommand& command,
                           const AgentPath& path) {
  if (!simulates_trainee(configuration.scenario)) return path.real;
  const auto* move = std::get_if<AgentMove>(&command);
  if (move != nullptr && move->agent == configuration.robot.name) return {std::nullopt};
  return {trainee_state(configuration, path.simulation)};
}

/// The trainee's robot is stopped and released by its own commands. If simulated, it can be unfrozen after a
/// freeze of all.
Status check_freeze(const Configuration& configuration, const AgentCommand& command) {
  const auto* freeze = std::get_if<AgentFreeze>(&command);
  if (freeze == nullptr || freeze->all || !configuration.find_robot(freeze->agent)) return {};
  if (!freeze->frozen && simulates_trainee(configuration.scenario)) return {};
  return Error{"'" + freeze->agent + "' is the trainee's robot: it is stopped and released by " +
               configuration.channels.bus(channel::kMrEmergencyStop)};
}

/// Applies an instructor's command, one function per type.
struct CommandHandler {
  const TickContext& context;
  const InstructorPath& path;

  template <class Command>
  requires std::is_constructible_v<AgentCommand, const Command&> Status operator()(const Command& command) {
    return apply_agent_command(context, command, path.agents);
  }
  Status operator()(const DoorCommand& command) {
    const Status done = path.agents.simulation.set_door(command);
    publish_simulation_events(context, path.agents.simulation);
    return done;
  }
  Status operator()(const FaultCommand& command) {
    return process_fault_command(context, command, path.faults);
  }
  Status operator()(const CameraRate& command) { return set_camera_rate(context, command, path.agents); }
  Status operator()(const ObjectReport& command) {
    handle_object_report(context, command, path);
    return {};
  }
  Status operator()(const ScriptStart& command) { return path.scripts.trigger(command.script, context.now); }
  Status operator()(const TrainingStart& /*command*/) {
    if (!path.start.waiting)
      return Error{"no training is waiting for a start: it has started, or the scenario has none"};
    start_training(context, {}, path.start);
    return {};
  }
  Status operator()(const EmergencyStopCommand& command) {
    if (is_for_trainee(context.configuration, command)) {
      for (std::size_t i = 0; i < path.robots.size(); ++i) {
        if (command.robot.empty() || command.robot == context.configuration.robot_at(i).name)
          set_emergency_stop(context.of_robot(i), command.engaged, path.robots[i]);
      }
      return {};
    }
    AgentFreeze freeze;
    freeze.request = command.request;
    freeze.agent = command.robot;
    freeze.frozen = command.engaged;
    return apply_agent_command(context, freeze, path.agents);
  }
};

/// Names come and go as long as the session runs: that of a removed agent is dropped.
void publish_agent_events(const TickContext& context, const AgentPath& path) {
  for (const Event& event : path.simulation.take_events()) {
    if (event.kind == EventKind::agent_removed) path.kinds.erase(event.subject);
    publish_event(context, event);
  }
}

}  // namespace

Status apply_agent_command(const TickContext& context, const AgentCommand& command, const AgentPath& path) {
  const auto* spawn = std::get_if<AgentSpawn>(&command);
  if (spawn != nullptr) {
    const Status fits = check_agent_camera(context.configuration, spawn->agent, path.cameras);
    if (!fits) return fits;
  }
  if (const Status allowed = check_freeze(context.configuration, command); !allowed) return allowed;
  Status done =
      path.simulation.command_among_robots(command, robots_to_avoid(context.configuration, command, path));
  if (done.ok() && spawn != nullptr) {
    path.kinds[spawn->agent.name] = spawn->agent.kind;
    if (spawn->agent.camera_rate > 0)
      done = set_agent_camera(context.configuration, spawn->agent, path.simulation.now(), path.cameras);
  }
  forget_agent_cameras(path.simulation, path.cameras);
  publish_agent_events(context, path);
  return done;
}

void handle_instructor_command(const TickContext& context, const Message& input, const InstructorPath& path) {
  InstructorCommand command;
  const Status read = read_command(context.configuration.channels, input, command);
  if (!read) refuse(context, read.error());
  if (!read && request_of(command) == 0) return;  // without a request number there is nobody to reply to
  const Status done = read ? std::visit(CommandHandler{context, path}, command) : read;
  Event answer;
  answer.stamp = context.now;
  answer.kind = done.ok() ? EventKind::command_accepted : EventKind::command_refused;
  answer.request = request_of(command);
  if (read) {  // unreadable commands are not echoed
    answer.subject = subject_of(command);
    answer.position = position_of(command);
  }
  if (!done.ok()) answer.text = done.error().message;
  publish_event(context, answer);
}

void refuse_late_command(const TickContext& context, std::uint64_t request) {
  Event answer;
  answer.stamp = context.now;
  answer.kind = EventKind::command_refused;
  answer.request = request;
  answer.text = "too many commands were waiting, or this one waited for longer than " +
                std::to_string(driving_timing::kMaxCommandAge.ns / 1'000'000'000) +
                " s; nothing was changed, and a robot that was stopped still is. Repeat it; if the server "
                "cannot keep up, remove agents first, or send "
                "fewer commands";
  publish_event(context, answer);
}

}  // namespace parhelion::tick
