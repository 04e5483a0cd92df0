// The importers, one for each format.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/import/import.hpp"

namespace parhelion::tools {

Result<ImportReport> import_rawlog(const ImportOptions& options, const ImportProgress& progress);
Result<ImportReport> import_carmen(const ImportOptions& options, const ImportProgress& progress);
Result<ImportReport> import_rosbag(const ImportOptions& options, const ImportProgress& progress);
Result<ImportReport> import_rgbd(const ImportOptions& options, const ImportProgress& progress);

/// The topic for `channel`: from --topics, else the only candidate; nullopt: none, or "none" was requested.
/// Error: several candidates, or a name that is not among them; the message lists them. `what` describes what
/// was looked for.
Result<std::optional<std::string>> choose_topic(const ImportOptions& options, const std::string& channel,
                                                const std::vector<std::string>& candidates,
                                                const std::string& what);

/// SCAN_<name>: a laser after the first.
bool is_further_scan(const std::string& channel);

struct LaserTopics {
  std::optional<std::string> scan, lines;
};
/// The topics for SCAN and LINES among `candidates`. A swept laser is chosen only on request: by its messages
/// it is a laser as any other.
Result<LaserTopics> choose_lasers(const ImportOptions& options, std::vector<std::string> candidates,
                                  const std::string& what);

}  // namespace parhelion::tools
