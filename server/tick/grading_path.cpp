#include "server/tick/grading_path.hpp"

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"

namespace parhelion::tick {
namespace {

/// The grader's own events trigger scripts, and are never graded.
void publish_changes(const TickContext& context, LiveGrading& grading) {
  for (const Event& event : grading.grader.take_events()) publish_event(context, event);
}

}  // namespace

std::unique_ptr<LiveGrading> make_grading(const Configuration& configuration, ArrivalTime start) {
  const auto& training = configuration.scenario.training;
  if (!training) return nullptr;
  // In microseconds, as in MR_SESSION.
  const SimulationTime begin = simulation_time(ArrivalTime::from_utime(start.utime()));
  return std::make_unique<LiveGrading>(
      LiveGrading{training::Grader(*training, configuration.model, configuration.robot,
                                   graded_robot(configuration), begin),
                  {},
                  {}});
}

void grade_event(const TickContext& context, const std::vector<std::uint8_t>& payload, LiveGrading& grading) {
  const Status read = decode(channel::kMrEvents, payload, grading.event);
  if (!read) return refuse(context, read.error());
  if (is_grading(grading.event.kind)) return;
  grading.grader.take(grading.event);
  publish_changes(context, grading);
}

void grade_world(const TickContext& context, const std::vector<std::uint8_t>& payload, LiveGrading& grading) {
  const Status read = decode(channel::kMrWorld, payload, grading.world);
  if (!read) return refuse(context, read.error());
  grading.grader.take(grading.world);
  publish_changes(context, grading);
}

void close_grading(const TickContext& context, LiveGrading& grading) {
  grading.grader.close(context.now);
  publish_changes(context, grading);
}

}  // namespace parhelion::tick
