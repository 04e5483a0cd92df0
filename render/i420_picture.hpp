// Pictures for video encoders: planar YCbCr 4:2:0, full range, BT.601 (as in JPEG, JFIF 1.02).
#pragma once

#include <cstdint>
#include <vector>

#include "protocols/image.hpp"
#include "protocols/status.hpp"
#include "render/jpeg.hpp"

namespace parhelion::render {

/// Width and height are even. Rows are contiguous without padding: `width` bytes of y, width / 2 of u and v.
struct I420Picture {
  int width = 0, height = 0;  ///< pixels
  std::vector<std::uint8_t> y, u, v;
};

/// Converts images from the bus; reuses its buffers. One thread at a time.
class I420Reader {
 public:
  I420Reader();
  ~I420Reader();
  I420Reader(const I420Reader&) = delete;
  I420Reader& operator=(const I420Reader&) = delete;

  /// From JPEG (decoded once, without conversion to RGB where its chroma is 4:2:0, 4:2:2, 4:4:0, 4:4:4 or
  /// gray), RGB, BGR or gray. A last odd column or row is dropped. Error: another format, a stream that is
  /// corrupt or truncated anywhere, fewer bytes than pixels, or less than 2 pixels in width or height;
  /// `picture` is then unspecified.
  Status read(const Image& image, I420Picture& picture);

 private:
  Status read_jpeg(const Image& image, I420Picture& picture);
  Status read_planes(const std::vector<std::uint8_t>& jpeg, const JpegFormat& format, I420Picture& picture);
  Status convert(const std::uint8_t* pixels, int stride, int tj_format, I420Picture& picture);

  JpegCodec codec_;
  void* decompressor_ = nullptr;
  void* compressor_ = nullptr;
  std::vector<std::uint8_t> bgr_, luma_, blue_, red_;
};

}  // namespace parhelion::render
