// Checks whether a machine has the memory for a scenario's crowd.
#pragma once

#include <cstdint>

#include "protocols/scenario.hpp"
#include "protocols/status.hpp"

namespace parhelion::runtime {

/// Bytes that the simulation needs for `bodies` moving bodies: two seconds of states, and their shapes.
std::uint64_t memory_of_bodies(std::uint64_t bodies, double physics_rate);

/// Error: the scenario's agents, or its max_agents if that is more than the default, need more than four
/// fifths of `available` (bytes, see available_memory()); the text gives the amount and how many would fit.
Status check_crowd(const Scenario& scenario, std::uint64_t available);

}  // namespace parhelion::runtime
