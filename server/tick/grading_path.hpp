// Passes MR_EVENTS and MR_WORLD to the grader, and publishes changes of the score.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "protocols/codec.hpp"
#include "protocols/event.hpp"
#include "server/tick/tick_context.hpp"
#include "server/training/grader.hpp"

namespace parhelion::tick {

/// Exists for a scenario with a training.
struct LiveGrading {
  std::vector<training::Grader> graders;  ///< one for each of graded_robots()
  Event event;                            ///< scratch
  WorldMessage world;                     ///< scratch
};

/// A grader for each of graded_robots(), in that order. The scenario has a training. The configuration must
/// outlive the result.
std::vector<training::Grader> make_graders(const Configuration& configuration, SimulationTime begin);

/// Null: nothing is graded. The configuration must outlive the result.
std::unique_ptr<LiveGrading> make_grading(const Configuration& configuration, ArrivalTime start);

// The grader reads the published payload and not the struct that it was encoded from: on the wire, stamps are
// rounded to microseconds and rotations become quaternions, so a limit that the struct just misses may be met
// by what the log holds. `grade` has only the log, and must reproduce the score to the bit. RESULTS.md gives
// the cost.

/// Grades a message of MR_EVENTS. Changes of the score are published on MR_EVENTS, too.
void grade_event(const TickContext& context, const std::vector<std::uint8_t>& payload, LiveGrading& grading);
/// The same for MR_WORLD.
void grade_world(const TickContext& context, const std::vector<std::uint8_t>& payload, LiveGrading& grading);
/// Closes the grading: a person ended the session.
void close_grading(const TickContext& context, LiveGrading& grading);

}  // namespace parhelion::tick
