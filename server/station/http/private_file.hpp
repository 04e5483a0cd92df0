// Files that only their owner can read.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "protocols/status.hpp"

namespace parhelion::station {

/// Creates the folder, accessible to its owner alone, if it does not exist.
Status make_private_folder(const std::filesystem::path& folder);

/// Error: others than its owner can change the folder's entries, and so remove an emergency stop or plant a
/// link. A folder that does not exist is good.
Status check_private_folder(const std::filesystem::path& folder);

/// Its whole content; nullopt: it does not exist. Error: unreadable, a link, not this user's, longer than 1
/// MiB, or other users can read or write it.
Result<std::optional<std::string>> read_private_file(const std::filesystem::path& file);

/// Replaces `file` atomically, mode 0600; it is on the disk when this returns. After an error it is
/// unchanged.
Status write_private_file(const std::filesystem::path& file, std::string_view text);

}  // namespace parhelion::station
