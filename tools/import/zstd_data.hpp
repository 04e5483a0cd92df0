// Decompresses zstd: messages, chunks and whole files of ROS 2 recordings.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion::tools {

bool is_zstd(std::span<const std::uint8_t> bytes);

/// All frames. Error: damaged, or more than `limit` bytes. What was inflated before stays in `out`.
Status inflate_zstd(std::span<const std::uint8_t> bytes, std::size_t limit, std::vector<std::uint8_t>& out);

/// A message that was compressed by itself, of at most 1 GiB.
Status inflate_message(std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& out);

/// Error: cannot be read or written; damaged, in which case what was inflated before is written; more than
/// the free space of the disk less 1 GiB.
Status inflate_zstd_file(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace parhelion::tools
