// Reads MCAP recordings (https://mcap.dev/spec) in file order. It needs no index, so it reads recordings that
// are cut off, and it checks every length before allocating memory. Debian 12 has no library for MCAP.
#pragma once

#include <filesystem>
#include <memory>

#include "tools/import/bag_source.hpp"

namespace parhelion::tools {

/// Errors of reading contain the offset of the damage. A damaged chunk is skipped; where the file itself is
/// damaged or cut off reading ends. Error: not readable, or no MCAP file.
Result<std::unique_ptr<BagSource>> open_mcap(const std::filesystem::path& path);

}  // namespace parhelion::tools
