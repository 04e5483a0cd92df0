#include "server/tick/script_path.hpp"

namespace parhelion::tick {
namespace {

/// `who`: an agent, a trainee's robot, or "trainee", the first robot.
std::optional<Eigen::Vector3d> place_of(const std::string& who, const Configuration& configuration,
                                        const AgentPath& path) {
  const auto& trainee = configuration.scenario.trainee;
  const auto robot = who == kTrainee ? std::optional<std::size_t>(0) : configuration.find_robot(who);
  const auto pose = path.simulation.pose_of(robot && trainee ? trainee->name : who);
  if (pose) return pose->translation();
  if (robot && path.real[*robot]) return path.real[*robot]->T_map_base.translation();
  return std::nullopt;
}

void start_script(const TickContext& context, const Scripts::Due& due, const AgentPath& path) {
  Event event;
  event.stamp = context.now;
  event.kind = EventKind::script_started;
  event.subject = due.script->name;
  event.object = due.triggered_by;
  publish_event(context, event);
  for (const AgentCommand& command : due.script->actions) {
    const Status done = apply_agent_command(context, command, path);
    if (done) continue;
    Event refused;
    refused.stamp = context.now;
    refused.kind = EventKind::command_refused;
    refused.subject = subject_of(to_instructor_command(command));
    refused.position = position_of(to_instructor_command(command));
    refused.text = "script '" + due.script->name + "': " + done.error().message;
    publish_event(context, refused);
  }
}

}  // namespace

void run_scripts(const TickContext& context, const ScriptPath& path) {
  if (context.configuration.scenario.scripts.empty()) return;
  path.scripts.update(
      context.now, [&](const std::string& who) { return place_of(who, context.configuration, path.agents); });
  for (const Scripts::Due& due : path.scripts.take_due(context.now)) start_script(context, due, path.agents);
}

}  // namespace parhelion::tick
