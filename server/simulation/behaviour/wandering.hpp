// Agents without a goal position: wandering, and patrolling between waypoints.
#pragma once

#include "server/simulation/bodies/agent.hpp"
#include "server/simulation/bodies/steering.hpp"
#include "server/simulation/bodies/step_clock.hpp"

namespace parhelion::simulation {

/// The key of an agent's random numbers, unique in each session with this seed.
std::uint64_t random_stream(std::uint64_t seed, std::uint64_t name_hash);

/// Moves straight on, with a new heading every few seconds. `steering`: with the obstacles around the agent.
Twist2 wander(Agent& agent, const StepClock& clock, SteeringScratch& steering);
/// Moves from waypoint to waypoint; wanders for a while if it is blocked.
Twist2 patrol(Agent& agent, const StepClock& clock, SteeringScratch& steering);

}  // namespace parhelion::simulation
