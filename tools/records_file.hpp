// Where the trainees' records are.
#pragma once

#include <string>

#include "server/training/records.hpp"

namespace parhelion::tools {

inline constexpr const char* kRecordsHelp =
    "Records; default: $PARHELION_RECORDS, or ~/.local/share/parhelion/records.db";

/// `chosen`; where it is empty, as kRecordsHelp says. Made with its folder where it is not there and is to
/// be created.
Result<training::Records> open_records(const std::string& chosen, bool create);

}  // namespace parhelion::tools
