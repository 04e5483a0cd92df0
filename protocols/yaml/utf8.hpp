// UTF-8 checks of input, and printable text for messages.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace parhelion::yaml {

/// Offset of the first byte that is not well-formed UTF-8 (Unicode 15, table 3-7), or nullopt. A NUL or 0x04
/// byte counts as ill-formed: the YAML scanner treats them as the end of the file.
std::optional<std::size_t> find_invalid_utf8(std::string_view text);

/// For messages and terminals: about `shown` bytes at most, control characters as \xNN.
std::string printable(std::string_view text, std::size_t shown = 60);

}  // namespace parhelion::yaml
