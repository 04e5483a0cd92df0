// Lessons: what goes wrong on purpose with the trainee's simulated robot, when it does.
#include <algorithm>
#include <cmath>
#include <vector>

#include "fusion/scan/lidar_model.hpp"
#include "server/tick.hpp"

namespace parhelion {
namespace {

constexpr std::uint64_t dropouts_seed = 0x9d5c0fb26c6e3a11U;  // apart from the noise of the ranges

/// Those of a kind that hold now.
std::vector<const Lesson*> held_lessons(const Configuration& configuration, const State& state,
                                        Lesson::Kind kind) {
  std::vector<const Lesson*> held;
  for (std::size_t i = 0; i < state.lessons.size(); ++i) {
    const Lesson& lesson = configuration.scenario.lessons[i];
    if (state.lessons[i] && lesson.kind == kind) held.push_back(&lesson);
  }
  return held;
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
  double kept = 1;
  for (const Lesson* lesson : held_lessons(configuration, state, Lesson::Kind::laser_dropouts))
    kept *= 1 - lesson->amount;
  if (kept == 1) return;
  const NoiseKey key{configuration.scenario.seed ^ dropouts_seed, state.scan.sequence};
  const auto nothing = configuration.robot.laser->convention.no_return_sentinel();
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double drawn = 0.5 * std::erfc(-standard_normal(key, i) / std::sqrt(2.0));  // even, 0 to 1
    if (drawn >= 1 - kept) continue;
    scan.ranges[i] = nothing;
    state.agent_laser.benches.front().body_hits[i].body = -1;  // of MR_SCAN_INFO
  }
}

Twist2 driven_twist(const Configuration& configuration, const State& state, const Twist2& asked) {
  bool left_dead = false, right_dead = false;
  for (const Lesson* lesson : held_lessons(configuration, state, Lesson::Kind::dead_wheel))
    (lesson->right ? right_dead : left_dead) = true;
  if (!left_dead && !right_dead) return asked;
  const auto model =
      std::find_if(configuration.robot_models.begin(), configuration.robot_models.end(),
                   [&](const auto& each) { return each->name == configuration.scenario.trainee->model; });
  const double track = (*model)->drive.track;
  const double left = left_dead ? 0 : asked.vx - 0.5 * track * asked.wz;  // m/s of each side
  const double right = right_dead ? 0 : asked.vx + 0.5 * track * asked.wz;
  return {(left + right) / 2, 0, (right - left) / track};
}

}  // namespace parhelion
