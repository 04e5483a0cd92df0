// Events and worlds to the grader, and what it says of them to MR_EVENTS.
#include "server/tick/grading_path.hpp"

namespace parhelion::tick {
namespace {

/// The grader's own words are heard by scripts, and never graded.
void publish_changes(const Configuration& configuration, State& state, Outputs& outputs) {
  for (const Event& event : state.grading->grader.take_events())
    publish_event(configuration, event, state, outputs);
}

}  // namespace

std::unique_ptr<LiveGrading> make_grading(const Configuration& configuration, ArrivalTime start) {
  const auto& training = configuration.scenario.training;
  if (!training) return nullptr;
  // As MR_SESSION keeps it, in microseconds.
  const SimulationTime begin = simulation_time(ArrivalTime::from_utime(start.utime()));
  return std::make_unique<LiveGrading>(
      LiveGrading{training::Grader(*training, configuration.model, configuration.robot,
                                   graded_robot(configuration), begin),
                  {},
                  {}});
}

void grade_event(const Configuration& configuration, const std::vector<std::uint8_t>& payload, State& state,
                 Outputs& outputs) {
  if (!state.grading) return;
  const Status read = decode(channel::mr_events, payload, state.grading->event);
  if (!read) return refuse(read.error(), state);
  if (is_grading(state.grading->event.kind)) return;
  state.grading->grader.take(state.grading->event);
  publish_changes(configuration, state, outputs);
}

void grade_world(const Configuration& configuration, const std::vector<std::uint8_t>& payload, State& state,
                 Outputs& outputs) {
  if (!state.grading) return;
  const Status read = decode(channel::mr_world, payload, state.grading->world);
  if (!read) return refuse(read.error(), state);
  state.grading->grader.take(state.grading->world);
  publish_changes(configuration, state, outputs);
}

void close_grading(const Configuration& configuration, SimulationTime end, State& state, Outputs& outputs) {
  if (!state.grading) return;
  state.grading->grader.close(end);
  publish_changes(configuration, state, outputs);
}

}  // namespace parhelion::tick
