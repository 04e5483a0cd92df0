// The score as it changes: the grader of `grade`, on the bytes that go out.
#pragma once

#include "server/tick/tick.hpp"
#include "server/training/grader.hpp"

namespace parhelion::tick {

/// Of a scenario with a training. Reads what was encoded, as whoever grades the log does: the same score to
/// the bit.
struct LiveGrading {
  training::Grader grader;
  Event event;         ///< scratch
  WorldMessage world;  ///< scratch
};

/// Null: nothing is graded. The configuration must outlive it.
std::unique_ptr<LiveGrading> make_grading(const Configuration& configuration, ArrivalTime start);
/// What went out on MR_EVENTS and on MR_WORLD; what changes with it goes out on MR_EVENTS.
void grade_event(const Configuration& configuration, const std::vector<std::uint8_t>& payload, State& state,
                 Outputs& outputs);
void grade_world(const Configuration& configuration, const std::vector<std::uint8_t>& payload, State& state,
                 Outputs& outputs);
/// The session was ended by a person.
void close_grading(const Configuration& configuration, SimulationTime end, State& state, Outputs& outputs);

}  // namespace parhelion::tick
