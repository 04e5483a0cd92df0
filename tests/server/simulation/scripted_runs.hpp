// Scripted runs, and the scores of their events: precision, recall and onset. A run's expected events are
// complete: any other event is wrong.
#pragma once

#include <algorithm>
#include <cstdio>
#include <functional>

#include "worlds.hpp"

namespace parhelion::test {

struct Expected {
  EventKind kind;
  double t;  ///< s from the start; the event is due at the first step at or after it
  std::string object = {};
  std::string subject = "pioneer";
};

struct Run {
  std::string name;
  double duration = 1;
  std::function<std::optional<simulation::RealRobotState>(double)> robot_at = {};
  std::vector<Expected> expected = {};
  SemanticModel model = {};
  simulation::SimulationOptions options = {};
  /// Expected events derived from the run's motion step by step, by rules of its own.
  std::function<void(const simulation::Simulation&, double, std::vector<Expected>&)> witness = {};
  bool limits = false;  ///< the robot has attitude limits
  std::function<void(simulation::Simulation&, double)> before_step = {};
  /// Depends on how the solver corrects penetration of the floor: neither expected nor counted.
  std::optional<EventKind> uncounted = {};
  bool on_stairs = false;  ///< a climbing robot touches steps: these contacts are true, and not counted
};

/// `expected`: extended by its witness.
inline std::vector<Event> events_of(const Run& run, std::vector<Expected>& expected) {
  RobotDescription description = robot();
  if (run.limits) description.attitude = AttitudeLimits{};
  auto simulation = simulation::Simulation::create(run.options, run.model, description, kStart);
  EXPECT_TRUE(simulation.ok());
  std::vector<simulation::LaserRequest> requests;
  for (int i = 1; i <= std::lround(run.duration / kStep); ++i) {
    if (run.before_step) run.before_step(*simulation, i * kStep);
    simulation->step(run.robot_at ? run.robot_at(i * kStep) : std::nullopt, requests);
    if (run.witness) run.witness(*simulation, i * kStep, expected);
  }
  std::vector<Event> events = simulation->take_events();
  std::erase_if(events, [&](const Event& event) {
    return event.kind == EventKind::agent_spawned || event.kind == run.uncounted ||
           (run.on_stairs && event.object.starts_with("step ") && event.kind != EventKind::step_climbed);
  });
  return events;
}

struct Score {
  int reported = 0, expected = 0, matched = 0, onset_late = 0, worst = 0;
};

/// Matches each event with the nearest expected one of its kind and entities; within half a second it is the
/// same event, and its onset is scored.
inline void judge(const Run& run, Score& score) {
  std::vector<Expected> expected = run.expected;
  const std::vector<Event> events = events_of(run, expected);
  std::vector<bool> taken(events.size(), false);
  score.reported += static_cast<int>(events.size());
  score.expected += static_cast<int>(expected.size());
  for (const Expected& due : expected) {
    const int due_step = std::max(1, static_cast<int>(std::ceil(due.t / kStep - 1e-6)));
    std::optional<std::size_t> best;
    int error = 120;
    for (std::size_t i = 0; i < events.size(); ++i) {
      const Event& event = events[i];
      if (taken[i] || event.kind != due.kind || event.object != due.object || event.subject != due.subject)
        continue;
      const int step = static_cast<int>(std::lround((event.stamp - kStart).seconds() / kStep));
      if (std::abs(step - due_step) >= error) continue;
      error = std::abs(step - due_step);
      best = i;
    }
    if (!best) {
      std::printf("%s: missed %s of '%s' at %.3f s\n", run.name.c_str(), to_string(due.kind),
                  due.object.c_str(), due.t);
      continue;
    }
    taken[*best] = true;
    ++score.matched;
    score.worst = std::max(score.worst, error);
    if (error <= 1) continue;
    ++score.onset_late;
    std::printf("%s: %s of '%s' at %.3f s came %d steps off\n", run.name.c_str(), to_string(due.kind),
                due.object.c_str(), due.t, error);
  }
  for (std::size_t i = 0; i < events.size(); ++i) {
    if (taken[i]) continue;
    std::printf("%s: false %s of '%s' and '%s' at %.3f s\n", run.name.c_str(), to_string(events[i].kind),
                events[i].subject.c_str(), events[i].object.c_str(), (events[i].stamp - kStart).seconds());
  }
}

inline void expect_good(const std::vector<Run>& runs, const char* what) {
  Score score;
  for (const Run& run : runs) judge(run, score);
  const double precision = static_cast<double>(score.matched) / score.reported;
  const double recall = static_cast<double>(score.matched) / score.expected;
  std::printf("%zu runs %s: %d events expected, %d said; precision %.4f, recall %.4f; worst onset %d steps\n",
              runs.size(), what, score.expected, score.reported, precision, recall, score.worst);
  EXPECT_GE(precision, 0.99);
  EXPECT_GE(recall, 0.99);
  EXPECT_EQ(score.onset_late, 0);
}

}  // namespace parhelion::test
