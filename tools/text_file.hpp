// Small text files that a command writes.
#pragma once

#include <string>

#include "protocols/status.hpp"

namespace parhelion {

/// Writes `text` to `path` in one go (a temporary file, then a rename); "-" is standard output. Fails where
/// the file exists, unless `overwrite`.
Status write_text(const std::string& path, const std::string& text, bool overwrite);

}  // namespace parhelion
