// Saves the current state of the session as a scenario.
#pragma once

#include <string>

#include "server/station/state_feed.hpp"

namespace parhelion::station {

struct SavedScenario {
  std::string path;
  std::size_t agents = 0;
  std::vector<std::string> left_out;  ///< agents without a known definition
};

/// Writes `folder`/`name`.yaml: the session's scenario with the current agents, their poses and behaviours.
/// Never overwrites. The error contains the reason.
Result<SavedScenario> save_scenario(StateFeed& feed, const std::string& folder, const std::string& name);

}  // namespace parhelion::station
