// Output files of commands: written atomically, and never overwritten without permission.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion::tools {

/// Error: `path` exists and may not be overwritten, is a folder, or its folder does not exist or is not
/// writable. Call it before work begins. "-" and an empty path are fine.
Status check_writable(const std::filesystem::path& path, bool overwrite);

/// Calls `write` with a new folder beside `path`, then moves each of `files` from it to the folder of `path`:
/// all of them or, on an error, none.
Status write_beside(const std::filesystem::path& path, const std::vector<std::string>& files,
                    const std::function<Status(const std::filesystem::path& folder)>& write);

enum class Readers { all, owner };  ///< all: according to the umask

/// Writes `text` to `path` atomically (a temporary file, then a rename); "-" is standard output. Error: the
/// file exists, unless `overwrite`.
Status write_text(const std::string& path, const std::string& text, bool overwrite,
                  Readers readers = Readers::all);

}  // namespace parhelion::tools
