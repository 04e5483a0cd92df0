// How well PNG pictures of this module and of its tools are compressed.
#pragma once

namespace parhelion::semantic {

/// zlib's level for pictures of plans and models: 9 takes four times as long for 5 % fewer bytes.
inline constexpr int kPngCompression = 6;

}  // namespace parhelion::semantic
