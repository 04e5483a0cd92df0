// Checks whether a machine simulates a scenario's crowd in real time.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "server/tick/configuration.hpp"

namespace parhelion::runtime {

/// Measured time of physics steps on this machine, with the first `agents` of the scenario.
struct CrowdStep {
  std::size_t agents = 0;
  double seconds = 0;  ///< wall time of one step, the median
};

/// Steps a separate world briefly: with the first `limit` agents of the scenario, without the sensors of the
/// robot and the agents. Nullopt if the world cannot be created; make_state() gives the reason.
std::optional<CrowdStep> time_crowd(const tick::Configuration& configuration, std::size_t limit);

/// A warning with a remedy, if all agents of the scenario (or its max_agents, if that is more than the
/// default) need more than an allowed fraction of real time at the measured time per agent; nullopt if they
/// fit.
std::optional<std::string> slow_crowd(const Scenario& scenario, const CrowdStep& measured);

/// Both, for crowds of some hundreds and more.
std::optional<std::string> warn_of_slow_crowd(const tick::Configuration& configuration);

}  // namespace parhelion::runtime
