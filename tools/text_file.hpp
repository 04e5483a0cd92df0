// Files that a command writes: whole or not at all, and none overwritten unasked.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion::tools {

/// An error where `path` exists and may not be overwritten, is a folder, or where its folder is not there or
/// cannot be written: to be asked before work begins. "-" and an empty path are fine.
Status check_writable(const std::filesystem::path& path, bool overwrite);

/// Calls `write` with a new folder beside `path`, then moves each of `files` from it to the folder of
/// `path`: all of them or, where anything fails, none.
Status write_beside(const std::filesystem::path& path, const std::vector<std::string>& files,
                    const std::function<Status(const std::filesystem::path& folder)>& write);

enum class Readers { all, owner };  ///< all: whom the umask lets

/// Writes `text` to `path` in one go (a temporary file, then a rename); "-" is standard output. Fails where
/// the file exists, unless `overwrite`.
Status write_text(const std::string& path, const std::string& text, bool overwrite,
                  Readers readers = Readers::all);

}  // namespace parhelion::tools
