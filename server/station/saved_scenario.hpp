// The session as it stands, as a scenario that starts so.
#pragma once

#include <string>

#include "server/station/state_feed.hpp"

namespace parhelion::station {

struct SavedScenario {
  std::string path;
  std::size_t agents = 0;
  std::vector<std::string> left_out;  ///< agents of which only the name is known
};

/// Writes `folder`/`name`.yaml: the session's scenario with the agents that are there now, where they are and
/// as they behave. Never overwrites. Errors say why it cannot be written.
Result<SavedScenario> save_scenario(StateFeed& feed, const std::string& folder, const std::string& name);

}  // namespace parhelion::station
