// Whether a machine can hold the crowd that a scenario asks for.
#pragma once

#include <cstdint>
#include <optional>

#include "protocols/scenario.hpp"
#include "protocols/status.hpp"

namespace parhelion::runtime {

/// Bytes that the simulation keeps for `bodies` moving bodies: their states of two seconds, their shapes.
std::uint64_t memory_of_bodies(std::uint64_t bodies, double physics_rate);

/// Bytes that this process may still take (MemAvailable of /proc/meminfo); nothing where nobody says.
std::optional<std::uint64_t> memory_available();

/// Error: the agents that the scenario names, or those that may come if its most_agents is more than the
/// default, take more than four fifths of `available`; the text says how much and how many would fit.
Status check_crowd(const Scenario& scenario, std::optional<std::uint64_t> available);

}  // namespace parhelion::runtime
