// JPEG decoding and encoding with libjpeg-turbo.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion::render {

/// Format of a JPEG, to re-encode it the same way.
struct JpegFormat {
  enum class Subsampling : std::uint8_t { yuv444, yuv422, yuv420, gray, yuv440, yuv411 };
  int width = 0, height = 0;
  int quality = 90;  ///< 1..100 on libjpeg's scale, estimated from the luminance quantisation table
  Subsampling subsampling = Subsampling::yuv420;
};

/// Decodes and encodes; keeps its buffers. An image that cannot be read has no effect on later ones. One
/// thread at a time.
class JpegCodec {
 public:
  JpegCodec();
  ~JpegCodec();
  JpegCodec(const JpegCodec&) = delete;
  JpegCodec& operator=(const JpegCodec&) = delete;

  /// Size and format from the header. Error: not a JPEG, an unsupported size or colour space, or so many
  /// scans that decoding could take most of a minute.
  Result<JpegFormat> read_header(const std::vector<std::uint8_t>& jpeg);
  /// To BGR, 3 * width bytes per row. Error: a stream that is truncated or corrupt anywhere.
  Result<JpegFormat> decode(const std::vector<std::uint8_t>& jpeg, std::vector<std::uint8_t>& bgr);
  Result<std::vector<std::uint8_t>> encode(const std::vector<std::uint8_t>& bgr, const JpegFormat& format);

 private:
  void renew_decompressor();

  void* decompressor_ = nullptr;
  void* compressor_ = nullptr;
  std::vector<std::uint8_t> buffer_;
};

/// The quality (1..100) whose scaled standard luminance table (ITU-T T.81, table K.1) is nearest to the
/// stream's own; 90 where the stream has none.
int estimate_jpeg_quality(const std::vector<std::uint8_t>& jpeg);

}  // namespace parhelion::render
