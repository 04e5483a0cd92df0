// Whether a machine steps the crowd of a scenario as fast as time goes.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "server/tick/configuration.hpp"

namespace parhelion::runtime {

/// What physics steps took on this machine, with the first `agents` of the scenario's.
struct CrowdStep {
  std::size_t agents = 0;
  double seconds = 0;  ///< of wall time for one step, the median
};

/// Steps a world of its own for a moment: with the first `most` agents of the scenario, without the robot's
/// and the agents' sensors. Nothing where there is no world to be made, which make_state() says.
std::optional<CrowdStep> time_crowd(const tick::Configuration& configuration, std::size_t most);

/// A warning that says what to do, where all agents that the scenario asks for (those that may come included,
/// if its most_agents is more than the default), at as much time for each, take more than
/// `share` of the time that there is: nothing where they fit.
std::optional<std::string> slow_crowd(const Scenario& scenario, const CrowdStep& measured);

/// Both, for crowds of some hundreds and more.
std::optional<std::string> warn_of_slow_crowd(const tick::Configuration& configuration);

}  // namespace parhelion::runtime
