// The first pass over a log: collects what replay needs before its first input.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "protocols/status.hpp"
#include "server/runtime/replay.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::runtime {

struct Preview {
  std::optional<SessionHeader> session;
  std::map<std::string, std::string> robot_yamls;         // by canonical channel: ROBOT, or ROBOT.<name>
  std::set<std::uint64_t> guarded_scans, dropped_frames;  // sequence numbers
  std::string damage;                                     // the first, or empty
  std::uint64_t events = 0;
};

/// Error: the log cannot be opened or holds no event; damage within it is only noted.
Result<Preview> look_ahead(const std::string& path);

/// The session's own configuration, with the replacements of the options. Error: the log is not a session and
/// the options do not define the agents, or there is no robot description.
Result<tick::Configuration> choose_configuration(const ReplayOptions& options, const Preview& preview);

}  // namespace parhelion::runtime
