// Decompresses chunks of a ROS 1 bag and parses record headers.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion::tools {

using BagFields = std::map<std::string, std::span<const std::uint8_t>, std::less<>>;

/// Parses "length name=value" fields up to the last byte; nullopt: malformed.
std::optional<BagFields> parse_bag_fields(std::span<const std::uint8_t> bytes);

/// Little-endian number of a field; nullopt: missing or of another size.
template <class T>
std::optional<T> bag_number(const BagFields& fields, const char* name);

/// Text of a field; empty: missing.
std::string bag_text(const BagFields& fields, const char* name);

/// `compression`: "none", "bz2" or "lz4". Error: unknown, damaged, or not `size` bytes. Data inflated before
/// the damage stays in `out`.
Status inflate_chunk(const std::string& compression, std::span<const std::uint8_t> bytes, std::uint32_t size,
                     std::vector<std::uint8_t>& out);

}  // namespace parhelion::tools
