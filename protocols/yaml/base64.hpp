// Bytes as text (RFC 4648, section 4), for `!!binary` values.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion::yaml {

std::string to_base64(std::span<const std::uint8_t> bytes);

/// Ignores white space between characters. Errors name the offset in `text`: an invalid character, wrong or
/// missing padding, bits left over.
Result<std::vector<std::uint8_t>> from_base64(std::string_view text);

}  // namespace parhelion::yaml
