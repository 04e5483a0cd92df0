// The part of validate for logs.
#pragma once

#include <string>

#include "tools/validate.hpp"

namespace parhelion::tools {

/// True if the first 64 kB of the file contain the sync word of an LCM event.
bool looks_like_log(const std::string& path);

Validation validate_log(const std::string& path);

}  // namespace parhelion::tools
