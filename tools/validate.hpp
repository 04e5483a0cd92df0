// Finds out what a file is, and whether it is sound.
#pragma once

#include <string>
#include <vector>

namespace parhelion::tools {

/// What was found about one file.
struct Validation {
  std::string summary;  ///< "scenario 'corridor', level 3, 2 agents"; empty where the kind is not known
  std::vector<std::string> notes;   ///< worth knowing, one line each: channels of a log
  std::vector<std::string> errors;  ///< with file and line, channel or offset
};

/// Scenario (with the model and robot that it names, and its agents' lasers), semantic model, robot
/// description, laser preset, ROS map, or LCM log: each event's frame, each message of a type that Parhelion
/// knows, and the YAML of ROBOT and MR_SESSION.
Validation validate_file(const std::string& path);

}  // namespace parhelion::tools
