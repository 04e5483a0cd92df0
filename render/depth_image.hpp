// DEPTH images: 16-bit millimetres along the optical axis, 0 = no measurement; raw, PNG or zlib, as given by
// the metadata entry "encoding" (default: raw).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocols/image.hpp"
#include "protocols/status.hpp"

namespace parhelion::render {

struct DepthPixels {
  int width = 0, height = 0;
  std::vector<std::uint16_t> millimetres;  ///< row by row; 0: no measurement
};

/// Decodes; 65535 (no measurement in some data sets) becomes 0. Error: another format, an unknown encoding,
/// an inconsistent size, a corrupt stream.
Result<DepthPixels> decode_depth(const Image& image);
/// The pixels as an image with the stamp, encoding and metadata of `like`.
Result<Image> encode_depth(const DepthPixels& pixels, const Image& like);

}  // namespace parhelion::render
