// DEPTH images: 16-bit millimetres along the optical axis, 0 = nothing measured; raw, PNG or zlib, as the
// metadata entry "encoding" says (raw where there is none).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocols/image.hpp"
#include "protocols/status.hpp"

namespace parhelion::render {

struct DepthPixels {
  int width = 0, height = 0;
  std::vector<std::uint16_t> millimetres;  ///< row by row; 0: nothing measured
};

/// Decodes; 65535 (no measurement in some data sets) becomes 0. Error: another format, an unknown encoding, a
/// size that lies, a corrupt stream.
Result<DepthPixels> decode_depth(const Image& image);
/// The pixels as an image of the same stamp, encoding and metadata as `like`.
Result<Image> encode_depth(const DepthPixels& pixels, const Image& like);

}  // namespace parhelion::render
