// The log half of validate.
#pragma once

#include <string>

#include "tools/validate.hpp"

namespace parhelion::tools {

/// True where the file holds the sync word of an LCM log's event within its first 64 kB.
bool looks_like_log(const std::string& path);

Validation validate_log(const std::string& path);

}  // namespace parhelion::tools
