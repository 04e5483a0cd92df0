// Image files in memory: reads their sizes, and re-encodes them for the wire if necessary.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "protocols/image.hpp"
#include "protocols/status.hpp"

namespace parhelion::tools {

/// A depth image: millimetres row by row, 0: no measurement.
struct DepthMillimetres {
  int width = 0, height = 0;
  std::vector<std::uint16_t> mm;
  bool as_written = false;  ///< unchanged numbers of the file
};

struct GreyPixels {
  int width = 0, height = 0;
  std::vector<std::uint8_t> grey;  ///< row by row
};

Result<GreyPixels> read_grey(std::span<const std::uint8_t> file);

/// True: a JPEG whose data stops before its end marker. Decoders fill the rest with grey.
bool is_cut_jpeg(std::span<const std::uint8_t> file);

/// JPEG bytes are kept (MJPEG). Any other colour file (PNG) becomes raw BGR, which is lossless.
Result<Image> colour_image(std::vector<std::uint8_t> file, SensorTime stamp);

/// 16-bit grey PNG with `units_per_metre` (1000: millimetres, 5000: TUM).
Result<DepthMillimetres> read_depth_png(std::span<const std::uint8_t> file, double units_per_metre);

/// Depth in the wire format: 16-bit PNG of millimetres, metadata "encoding" = "png".
Result<Image> depth_image(const DepthMillimetres& depth, SensorTime stamp);
/// The same from a PNG that contains millimetres already.
Image depth_image(std::vector<std::uint8_t> png, int width, int height, SensorTime stamp);

Result<std::vector<std::uint8_t>> read_file(const std::string& path);

}  // namespace parhelion::tools
