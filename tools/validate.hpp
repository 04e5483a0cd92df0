// Detects the kind of a file and checks its content.
#pragma once

#include <string>
#include <vector>

namespace parhelion::tools {

/// Result for one file.
struct Validation {
  std::string summary;             ///< "scenario 'corridor', level 3, 2 agents"; empty if the kind is unknown
  std::vector<std::string> notes;  ///< further information, one line each: channels of a log
  std::vector<std::string> errors;  ///< with file and line, channel or offset
};

/// Scenario (with its model, robot and the lasers of its agents), semantic model, robot description, laser
/// preset, ROS map, or LCM log: each event's frame, each message of a known type, and the YAML of ROBOT and
/// MR_SESSION.
Validation validate_file(const std::string& path);

}  // namespace parhelion::tools
