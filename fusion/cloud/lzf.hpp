// LZF, the compression of PCD's binary_compressed (format as in Lehmann's liblzf).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "protocols/status.hpp"

namespace parhelion::cloud {

/// Upper bound of the expansion of an LZF stream: 3 bytes make at most 264.
constexpr std::uint64_t kLzfMaxRatio = 88;

/// Exactly `size` bytes, or an Error that names the offset in `compressed` where decoding failed.
Result<std::string> lzf_decompress(std::string_view compressed, std::size_t size);

}  // namespace parhelion::cloud
