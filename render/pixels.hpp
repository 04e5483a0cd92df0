// Pixels of an image_t as BGR, and back with unchanged pixels where nothing was drawn. Private to this
// module's sources.
#pragma once

#include <cstdint>
#include <vector>

#include "protocols/image.hpp"
#include "render/jpeg.hpp"
#include "render/layer_renderer.hpp"

namespace parhelion::render {

/// A decoded image: BGR, 3 * width bytes per row.
struct BgrFrame {
  int width = 0, height = 0;
  JpegFormat jpeg;  ///< only where the image is one
  std::vector<std::uint8_t> bgr;
};

/// Size of the image, from the JPEG's own header where it is one. Error: an inconsistent size, too few bytes,
/// a format without colour.
Result<JpegFormat> image_size(const Image& image, JpegCodec& codec);
Status read_pixels(const Image& image, JpegCodec& codec, BgrFrame& frame);

/// Blends the layer over the frame (premultiplied source-over): a pixel without coverage is not written
/// (promise 5). True where at least one pixel has coverage.
bool blend(const Layer& layer, BgrFrame& frame);
bool has_coverage(const Layer& layer);

/// Writes the frame in the format of `image`: a JPEG again with its original quality and subsampling; raw
/// formats only where the layer has coverage.
Status write_pixels(const BgrFrame& frame, const Layer& layer, JpegCodec& codec, Image& image);

}  // namespace parhelion::render
