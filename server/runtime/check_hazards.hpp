// Checks the names in a scenario's hazards, and in its events of hazards and doses.
#pragma once

#include <string>

#include "server/runtime/session_files.hpp"

namespace parhelion::runtime {

/// `files` of the scenario at `path`, with its objects. Error: file and line of a hazard whose agent can
/// never exist, or of a task or penalty whose event of a hazard or dose can never occur, with the names that
/// there are.
Status check_hazards(const std::string& path, const SessionFiles& files);

}  // namespace parhelion::runtime
