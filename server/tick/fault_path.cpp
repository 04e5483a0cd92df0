// Lessons: what goes wrong on purpose with the trainee's simulated robot, when it does.
#include <algorithm>
#include <cmath>
#include <vector>

#include "fusion/scan/lidar_model.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::tick {
namespace {

constexpr std::uint64_t dropouts_seed = 0x9d5c0fb26c6e3a11U;  // apart from the noise of the ranges

/// Those of a kind that hold now.
std::vector<const Lesson*> held_lessons(const State& state, Lesson::Kind kind) {
  std::vector<const Lesson*> held;
  for (const HeldLesson& each : state.lessons) {
    if (each.holds && each.lesson.kind == kind) held.push_back(&each.lesson);
  }
  return held;
}

Status check_lesson(const Configuration& configuration, const Lesson& lesson) {
  const std::string name = to_string(lesson.kind);
  if (lesson.kind == Lesson::Kind::low_battery)
    return Error{"'low_battery' is how a session starts: put it into the scenario's 'lessons'"};
  if (needs_simulated_robot(lesson.kind) && !simulates_trainee(configuration.scenario))
    return Error{"'" + name +
                 "' is a lesson for simulated robots: nothing is taken from a real one's sensors or drive"};
  const double most = lesson.kind == Lesson::Kind::camera_delay ? 0.5 : 1;
  if (lesson.kind != Lesson::Kind::dead_wheel && !(lesson.amount >= 0 && lesson.amount <= most))
    return Error{"lesson '" + name + "': its amount is " + std::to_string(lesson.amount) +
                 ", expected 0 to " + (most < 1 ? "0.5 s" : "1")};
  return {};
}

/// Of the lessons that were begun by command; before it are the scenario's.
std::vector<HeldLesson>::iterator first_begun(const Configuration& configuration, State& state) {
  return state.lessons.begin() + static_cast<std::ptrdiff_t>(configuration.scenario.lessons.size());
}

/// Those of a kind, and of one side where that is said. False: there are none.
bool end_begun_lessons(const Configuration& configuration, Lesson::Kind kind, std::optional<bool> right,
                       double age, State& state) {
  bool any = false;
  for (auto each = first_begun(configuration, state); each != state.lessons.end(); ++each) {
    Lesson& lesson = each->lesson;
    if (lesson.kind != kind || (right && lesson.right != *right) || !lesson.holds(age)) continue;
    lesson.lasting = age - lesson.after;
    any = true;
  }
  return any;
}

void block_dead_sides(const Configuration& configuration, State& state) {
  bool left = false, right = false;
  for (const Lesson* lesson : held_lessons(state, Lesson::Kind::dead_wheel))
    (lesson->right ? right : left) = true;
  state.simulation.block_sides(configuration.robot.name, left, right);
}

}  // namespace

void watch_lessons(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs) {
  for (auto& [lesson, held] : state.lessons) {
    const bool holds = lesson.holds((now - state.started).seconds());
    if (holds == held) continue;
    held = holds;
    Event event;
    event.stamp = now;
    event.kind = holds ? EventKind::lesson_started : EventKind::lesson_ended;
    event.subject = configuration.robot.name;
    event.object = to_string(lesson.kind);
    event.value = lesson.amount;
    if (lesson.kind == Lesson::Kind::dead_wheel) {
      event.text = lesson.right ? "right" : "left";
      block_dead_sides(configuration, state);
    }
    publish_event(configuration, event, state, outputs);
  }
}

Status process_fault_command(const Configuration& configuration, const FaultCommand& command,
                             SimulationTime now, State& state) {
  const double age = (now - state.started).seconds();
  if (!command.begins) {
    if (end_begun_lessons(configuration, command.kind, std::nullopt, age, state)) return {};
    return Error{"lesson '" + std::string(to_string(command.kind)) +
                 "' was not begun, so it cannot be ended"};
  }
  const bool wheel = command.kind == Lesson::Kind::dead_wheel;
  Lesson lesson;
  lesson.kind = command.kind;
  lesson.amount = wheel ? 0 : command.amount;
  lesson.right = wheel && command.right;
  lesson.after = age;
  lesson.lasting = command.duration;
  if (const Status fits = check_lesson(configuration, lesson); !fits) return fits;
  end_begun_lessons(configuration, command.kind, wheel ? std::optional(lesson.right) : std::nullopt, age,
                    state);
  // What is over is not kept: there is no end to what an instructor may begin.
  state.lessons.erase(
      std::remove_if(first_begun(configuration, state), state.lessons.end(),
                     [&](const HeldLesson& each) { return !each.holds && !each.lesson.holds(age); }),
      state.lessons.end());
  state.lessons.push_back({lesson});
  return {};
}

void drop_beams(const Configuration& configuration, State& state, Scan& scan) {
  double kept = 1;
  for (const Lesson* lesson : held_lessons(state, Lesson::Kind::laser_dropouts)) kept *= 1 - lesson->amount;
  if (kept == 1) return;
  const scan::NoiseKey key{configuration.scenario.seed ^ dropouts_seed, state.scan.sequence};
  const auto nothing = configuration.robot.laser->convention.no_return_sentinel();
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double drawn = 0.5 * std::erfc(-scan::standard_normal(key, i) / std::sqrt(2.0));  // even, 0 to 1
    if (drawn >= 1 - kept) continue;
    scan.ranges[i] = nothing;
    state.agent_laser.benches.front().body_hits[i].body = -1;  // of MR_SCAN_INFO
  }
}

}  // namespace parhelion::tick
