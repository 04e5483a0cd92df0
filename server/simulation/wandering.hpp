// Agents without a goal of their own: to wander about, and to patrol between waypoints.
#pragma once

#include "server/simulation/agent.hpp"
#include "server/simulation/steering.hpp"
#include "server/simulation/step_clock.hpp"

namespace parhelion::simulation {

/// The key of an agent's random numbers: its own in each session of this seed.
std::uint64_t random_stream(std::uint64_t seed, std::uint64_t name_hash);

/// Straight on with a new heading every few seconds. `steering`: with the obstacles around the agent.
Twist2 wander(Agent& agent, const StepClock& clock, SteeringScratch& steering);
/// From waypoint to waypoint; wanders for a while where something blocks it.
Twist2 patrol(Agent& agent, const StepClock& clock, SteeringScratch& steering);

}  // namespace parhelion::simulation
