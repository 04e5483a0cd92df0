// The part of validate for logs.
#pragma once

#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "tools/validate.hpp"

namespace parhelion::tools {

/// True if the first 64 kB of the file contain the sync word of an LCM event.
bool looks_like_log(const std::string& path);

/// Why `path` has nothing on a channel: it is no log, its events cannot be read, or the channel is another
/// one. `findings`: what decoding the log's events reported.
Error holds_no_event(const std::string& path, const std::string& channel,
                     const std::vector<std::string>& findings);

Validation validate_log(const std::string& path);

}  // namespace parhelion::tools
