#include "server/tick/grading_path.hpp"

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"

namespace parhelion::tick {
namespace {

/// The grader's own events trigger scripts, and are never graded.
void publish_changes(const TickContext& context, LiveGrading& grading) {
  for (training::Grader& grader : grading.graders) {
    for (const Event& event : grader.take_events()) publish_event(context, event);
  }
}

}  // namespace

std::vector<training::Grader> make_graders(const Configuration& configuration, SimulationTime begin) {
  std::vector<training::Grader> graders;
  for (const std::string& robot : graded_robots(configuration)) {
    // An agent that is graded has the camera of the first robot's description.
    const RobotDescription& description = configuration.robot_at(configuration.find_robot(robot).value_or(0));
    graders.emplace_back(*configuration.scenario.training, configuration.model, description, robot, begin);
  }
  return graders;
}

std::unique_ptr<LiveGrading> make_grading(const Configuration& configuration, ArrivalTime start) {
  const auto& training = configuration.scenario.training;
  if (!training) return nullptr;
  // In microseconds, as in MR_SESSION.
  const SimulationTime begin = simulation_time(ArrivalTime::from_utime(start.utime()));
  return std::make_unique<LiveGrading>(LiveGrading{make_graders(configuration, begin), {}, {}});
}

void grade_event(const TickContext& context, const std::vector<std::uint8_t>& payload, LiveGrading& grading) {
  const Status read = decode(channel::kMrEvents, payload, grading.event);
  if (!read) return refuse(context, read.error());
  if (is_grading(grading.event.kind)) return;
  for (training::Grader& grader : grading.graders) grader.take(grading.event);
  publish_changes(context, grading);
}

void grade_world(const TickContext& context, const std::vector<std::uint8_t>& payload, LiveGrading& grading) {
  const Status read = decode(channel::kMrWorld, payload, grading.world);
  if (!read) return refuse(context, read.error());
  for (training::Grader& grader : grading.graders) grader.take(grading.world);
  publish_changes(context, grading);
}

void close_grading(const TickContext& context, LiveGrading& grading) {
  for (training::Grader& grader : grading.graders) grader.close(context.now);
  publish_changes(context, grading);
}

}  // namespace parhelion::tick
