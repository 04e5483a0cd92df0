// Location of the trainees' records.
#pragma once

#include <string>

#include "server/training/records.hpp"

namespace parhelion::tools {

inline constexpr const char* kRecordsHelp =
    "Records; default: $PARHELION_RECORDS, or ~/.local/share/parhelion/records.db";

/// `chosen`, or if it is empty the default described in kRecordsHelp. Created with its folder if it does not
/// exist and `create` is set.
Result<training::Records> open_records(const std::string& chosen, bool create);

}  // namespace parhelion::tools
