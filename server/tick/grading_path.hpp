// MR_EVENTS and MR_WORLD to the grader: the score as it changes.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "protocols/codec.hpp"
#include "protocols/event.hpp"
#include "server/tick/tick_context.hpp"
#include "server/training/grader.hpp"

namespace parhelion::tick {

/// Of a scenario with a training.
struct LiveGrading {
  training::Grader grader;
  Event event;         ///< scratch
  WorldMessage world;  ///< scratch
};

/// Null: nothing is graded. The configuration must outlive it.
std::unique_ptr<LiveGrading> make_grading(const Configuration& configuration, ArrivalTime start);

// The grader reads the payload that goes out and not the struct that it was encoded from, although both are
// at hand: on the wire stamps are rounded to microseconds and rotations become quaternions, so a limit that
// the struct just misses may be met by what the log holds. `grade` has only the log, and must find the same
// score to the bit. RESULTS.md has what it costs.

/// Grades what went out on MR_EVENTS. What changes with it goes out on MR_EVENTS, too.
void grade_event(const TickContext& context, const std::vector<std::uint8_t>& payload, LiveGrading& grading);
/// The same for MR_WORLD.
void grade_world(const TickContext& context, const std::vector<std::uint8_t>& payload, LiveGrading& grading);
/// The session was ended by a person.
void close_grading(const TickContext& context, LiveGrading& grading);

}  // namespace parhelion::tick
