// Lessons: what goes wrong on purpose with the trainee's simulated robot, when it does.
#include <cmath>

#include "fusion/scan/lidar_model.hpp"
#include "server/tick.hpp"

namespace parhelion {
namespace {

constexpr std::uint64_t dropouts_seed = 0x9d5c0fb26c6e3a11U;  // apart from the noise of the ranges

const Lesson* held_lesson(const Configuration& configuration, const State& state, Lesson::Kind kind) {
  for (std::size_t i = 0; i < state.lessons.size(); ++i) {
    const Lesson& lesson = configuration.scenario.lessons[i];
    if (state.lessons[i] && lesson.kind == kind) return &lesson;
  }
  return nullptr;
}

}  // namespace

void watch_lessons(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs) {
  const auto& lessons = configuration.scenario.lessons;
  state.lessons.resize(lessons.size());
  for (std::size_t i = 0; i < lessons.size(); ++i) {
    const bool holds = lessons[i].holds((now - state.started).seconds());
    if (holds == state.lessons[i]) continue;
    state.lessons[i] = holds;
    Event event;
    event.stamp = now;
    event.kind = holds ? EventKind::lesson_started : EventKind::lesson_ended;
    event.subject = configuration.robot.name;
    event.object = to_string(lessons[i].kind);
    event.value = lessons[i].amount;
    if (lessons[i].kind == Lesson::Kind::dead_wheel) event.text = lessons[i].right ? "right" : "left";
    publish_event(configuration, event, state, outputs);
  }
}

void drop_beams(const Configuration& configuration, State& state, Scan& scan) {
  const Lesson* lesson = held_lesson(configuration, state, Lesson::Kind::laser_dropouts);
  if (!lesson) return;
  const NoiseKey key{configuration.scenario.seed ^ dropouts_seed, state.scan.sequence};
  const auto nothing = configuration.robot.laser->convention.no_return_sentinel();
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double drawn = 0.5 * std::erfc(-standard_normal(key, i) / std::sqrt(2.0));  // even, 0 to 1
    if (drawn >= lesson->amount) continue;
    scan.ranges[i] = nothing;
    state.agent_laser.benches.front().body_hits[i].body = -1;  // of MR_SCAN_INFO
  }
}

Twist2 driven_twist(const Configuration& configuration, const State& state, const Twist2& asked) {
  const Lesson* lesson = held_lesson(configuration, state, Lesson::Kind::dead_wheel);
  if (!lesson) return asked;
  const auto model =
      std::find_if(configuration.robot_models.begin(), configuration.robot_models.end(),
                   [&](const auto& each) { return each->name == configuration.scenario.trainee->model; });
  const double track = (*model)->drive.track;
  // m/s of the side that still turns; the other stands.
  const double speed = asked.vx + (lesson->right ? -0.5 : 0.5) * track * asked.wz;
  return {speed / 2, 0, (lesson->right ? -speed : speed) / track};
}

}  // namespace parhelion
