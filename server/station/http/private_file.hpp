// Files that only their owner may read.
#pragma once

#include <filesystem>
#include <string_view>

#include "protocols/status.hpp"

namespace parhelion::station {

/// Makes the folder, for its owner alone, where it is not there.
Status make_private_folder(const std::filesystem::path& folder);

/// Replaces `file` as a whole, mode 0600; it is on the disk when this returns. After an error it is as it
/// was.
Status write_private_file(const std::filesystem::path& file, std::string_view text);

}  // namespace parhelion::station
