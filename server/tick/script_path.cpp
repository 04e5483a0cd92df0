// Scripts that are due: their actions are commands that nobody sent, answered by events only where they fail.
#include "server/tick/tick.hpp"

namespace parhelion::tick {
namespace {

std::optional<Eigen::Vector3d> place_of(const std::string& who, const Configuration& configuration,
                                        const State& state) {
  const auto& trainee = configuration.scenario.trainee;
  const bool is_trainee = who == kTrainee || who == configuration.robot.name;
  const auto pose = state.simulation.pose_of(is_trainee && trainee ? trainee->name : who);
  if (pose) return pose->translation();
  if (is_trainee && state.real) return state.real->T_map_base.translation();
  return std::nullopt;
}

void start_script(const Configuration& configuration, const Scripts::Due& due, SimulationTime now,
                  State& state, Outputs& outputs) {
  Event event;
  event.stamp = now;
  event.kind = EventKind::script_started;
  event.subject = due.script->name;
  event.object = due.set_off_by;
  publish_event(configuration, event, state, outputs);
  for (const AgentCommand& command : due.script->actions) {
    const Status done = do_agent_command(configuration, command, state, outputs);
    if (done) continue;
    Event refused;
    refused.stamp = now;
    refused.kind = EventKind::command_refused;
    refused.subject = subject_of(to_instructor_command(command));
    refused.position = position_of(to_instructor_command(command));
    refused.text = "script '" + due.script->name + "': " + done.error().message;
    publish_event(configuration, refused, state, outputs);
  }
}

}  // namespace

void run_scripts(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs) {
  if (configuration.scenario.scripts.empty()) return;
  state.scripts.look(now, [&](const std::string& who) { return place_of(who, configuration, state); });
  for (const Scripts::Due& due : state.scripts.take_due(now))
    start_script(configuration, due, now, state, outputs);
}

}  // namespace parhelion::tick
