#include "render/pixels.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include "render/image_limits.hpp"

namespace parhelion::render {
namespace {

int channels_of(PixelFormat format) { return format == PixelFormat::gray ? 1 : 3; }

/// BT.601 in 16-bit fixed point, as JPEG's own Y.
std::uint8_t luma(const std::uint8_t* bgr) {
  return static_cast<std::uint8_t>((7471U * bgr[0] + 38470U * bgr[1] + 19595U * bgr[2] + 32768U) >> 16);
}

std::size_t stride_of(const Image& image) {
  return image.row_stride > 0
             ? static_cast<std::size_t>(image.row_stride)
             : static_cast<std::size_t>(image.width) * static_cast<std::size_t>(channels_of(image.format));
}

}  // namespace

Result<JpegFormat> image_size(const Image& image, JpegCodec& codec) {
  if (image.format == PixelFormat::mjpeg) return codec.read_header(image.bytes);
  const std::string size = std::to_string(image.width) + "x" + std::to_string(image.height);
  if (image.format != PixelFormat::gray && image.format != PixelFormat::rgb &&
      image.format != PixelFormat::bgr)
    return Error{"image: the pixel format " + std::to_string(static_cast<int>(image.format)) +
                 " is not handled; expected MJPEG, RGB, BGR or GRAY"};
  if (image.width <= 0 || image.height <= 0 || image.width > kMaxImageSide || image.height > kMaxImageSide)
    return Error{"image: " + size + ", expected 1 to " + std::to_string(kMaxImageSide) + " pixels a side"};
  const std::size_t row =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(channels_of(image.format));
  if (stride_of(image) < row ||
      image.bytes.size() < stride_of(image) * static_cast<std::size_t>(image.height - 1) + row)
    return Error{"image: " + std::to_string(image.bytes.size()) + " bytes with a row stride of " +
                 std::to_string(image.row_stride) + " are too few for " + size};
  JpegFormat format;
  format.width = image.width, format.height = image.height;
  return format;
}

Status read_pixels(const Image& image, JpegCodec& codec, BgrFrame& frame) {
  if (image.format == PixelFormat::mjpeg) {
    auto format = codec.decode(image.bytes, frame.bgr);
    if (!format) return format.error();
    frame.jpeg = *format;
    frame.width = format->width, frame.height = format->height;
    return {};
  }
  auto format = image_size(image, codec);
  if (!format) return format.error();
  frame.width = image.width, frame.height = image.height;
  frame.bgr.resize(3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* in = image.bytes.data() + static_cast<std::size_t>(y) * stride_of(image);
    std::uint8_t* out =
        frame.bgr.data() + 3 * static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width);
    switch (image.format) {
      case PixelFormat::gray:
        for (int x = 0; x < image.width; ++x, out += 3) out[0] = out[1] = out[2] = in[x];
        break;
      case PixelFormat::rgb:
        for (int x = 0; x < image.width; ++x, out += 3, in += 3)
          out[0] = in[2], out[1] = in[1], out[2] = in[0];
        break;
      default:
        std::memcpy(out, in, 3 * static_cast<std::size_t>(image.width));
        break;
    }
  }
  return {};
}

bool has_coverage(const Layer& layer) {
  if (layer.rect.empty()) return false;
  const std::size_t count =
      static_cast<std::size_t>(layer.rect.width()) * static_cast<std::size_t>(layer.rect.height());
  for (std::size_t i = 0; i < count; ++i)
    if (layer.rgba[4 * i + 3]) return true;
  return false;
}

bool blend(const Layer& layer, BgrFrame& frame) {
  bool any = false;
  for (int y = layer.rect.y0; y < layer.rect.y1; ++y) {
    const std::uint8_t* in = &layer.rgba[4 * layer.at(layer.rect.x0, y)];
    std::uint8_t* out = &frame.bgr[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) +
                                        static_cast<std::size_t>(layer.rect.x0))];
    for (int x = layer.rect.x0; x < layer.rect.x1; ++x, in += 4, out += 3) {
      const unsigned coverage = in[3];
      if (coverage == 0) continue;
      any = true;
      const unsigned rest = 255 - coverage;
      for (int c = 0; c < 3; ++c)
        out[c] = static_cast<std::uint8_t>(std::min(255U, in[2 - c] + (out[c] * rest + 127) / 255));
    }
  }
  return any;
}

Status write_pixels(const BgrFrame& frame, const Layer& layer, JpegCodec& codec, Image& image) {
  if (image.format == PixelFormat::mjpeg) {
    auto bytes = codec.encode(frame.bgr, frame.jpeg);
    if (!bytes) return bytes.error();
    image.bytes = std::move(*bytes);
    return {};
  }
  for (int y = layer.rect.y0; y < layer.rect.y1; ++y) {
    for (int x = layer.rect.x0; x < layer.rect.x1; ++x) {
      if (!layer.rgba[4 * layer.at(x, y) + 3]) continue;
      const std::uint8_t* in =
          &frame.bgr[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) +
                          static_cast<std::size_t>(x))];
      std::uint8_t* out =
          &image.bytes[static_cast<std::size_t>(y) * stride_of(image) +
                       static_cast<std::size_t>(x) * static_cast<std::size_t>(channels_of(image.format))];
      switch (image.format) {
        case PixelFormat::gray:
          *out = luma(in);
          break;
        case PixelFormat::rgb:
          out[0] = in[2], out[1] = in[1], out[2] = in[0];
          break;
        default:
          std::memcpy(out, in, 3);
          break;
      }
    }
  }
  return {};
}

}  // namespace parhelion::render
