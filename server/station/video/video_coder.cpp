#include "server/station/video/video_coder.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace parhelion::station {
namespace {

constexpr int kJpegQuality = 85;  // of raw images
constexpr double kWorthIt = 0.1;  // smaller relative changes of the bit rate are ignored

/// 3 * width bytes per row.
Status to_bgr(const Image& image, std::vector<std::uint8_t>& bgr) {
  const bool gray = image.format == PixelFormat::gray, rgb = image.format == PixelFormat::rgb;
  const std::size_t width = static_cast<std::size_t>(std::max(image.width, 0));
  const std::size_t height = static_cast<std::size_t>(std::max(image.height, 0));
  const std::size_t stride = static_cast<std::size_t>(std::max(image.row_stride, 0));
  if (!gray && !rgb && image.format != PixelFormat::bgr)
    return Error{"image: unsupported pixel format; expected JPEG, RGB, BGR or gray"};
  if (stride < width * (gray ? 1 : 3) || image.bytes.size() < stride * height)
    return Error{"image: fewer bytes than pixels"};
  bgr.resize(3 * width * height);
  std::uint8_t* out = bgr.data();
  for (std::size_t row = 0; row < height; ++row) {
    const std::uint8_t* in = image.bytes.data() + row * stride;
    for (std::size_t x = 0; x < width; ++x, out += 3) {
      const std::uint8_t* pixel = in + x * (gray ? 1 : 3);
      out[0] = pixel[gray ? 0 : rgb ? 2 : 0];
      out[1] = pixel[gray ? 0 : 1];
      out[2] = pixel[gray ? 0 : rgb ? 0 : 2];
    }
  }
  return {};
}

}  // namespace

Status VideoCoder::follow(int bit_rate) {
  if (std::abs(bit_rate - bit_rate_) < kWorthIt * bit_rate_) return {};
  bit_rate_ = bit_rate;
  return encoder_->set_bit_rate(bit_rate);
}

Status VideoCoder::code_h264(const Image& image, const VideoWanted& wanted, CodedPicture& coded) {
  if (Status read = reader_.read(image, picture_); !read) return read;
  coded.width = picture_.width;
  coded.height = picture_.height;
  if (encoder_ == nullptr || encoder_->width() != picture_.width || encoder_->height() != picture_.height) {
    auto made = render::H264Encoder::create(picture_.width, picture_.height, {wanted.bit_rate, 30});
    encoder_ = made ? std::move(*made) : nullptr;
    if (!made) return coded.h264_fault = made.error().message, Status{};
    bit_rate_ = wanted.bit_rate;
  }
  if (Status followed = follow(wanted.bit_rate); !followed) coded.h264_fault = followed.error().message;
  auto picture = encoder_->encode(picture_, image.stamp, wanted.key);
  if (!picture) {
    coded.h264_fault = picture.error().message;
    encoder_.reset();  // the next encoder starts with a key frame
    return {};
  }
  coded.key = picture->key;
  coded.h264 = std::move(picture->bytes);
  return {};
}

Status VideoCoder::code_jpeg(const Image& image, CodedPicture& coded) {
  if (image.format == PixelFormat::mjpeg) {
    const auto format = jpeg_.read_header(image.bytes);
    if (!format) return format.error();
    coded.width = format->width;
    coded.height = format->height;
    coded.jpeg = image.bytes;
    return {};
  }
  if (Status read = to_bgr(image, bgr_); !read) return read;
  const bool gray = image.format == PixelFormat::gray;
  auto made = jpeg_.encode(
      bgr_, {image.width, image.height, kJpegQuality,
             gray ? render::JpegFormat::Subsampling::gray : render::JpegFormat::Subsampling::yuv420});
  if (!made) return made.error();
  coded.width = image.width;
  coded.height = image.height;
  coded.jpeg = std::move(*made);
  return {};
}

Result<CodedPicture> VideoCoder::code(const Image& image, const VideoWanted& wanted) {
  CodedPicture coded;
  if (wanted.h264) {
    if (Status done = code_h264(image, wanted, coded); !done) return done.error();
  } else {
    encoder_.reset();
  }
  if (wanted.jpeg || !coded.h264_fault.empty()) {
    if (Status done = code_jpeg(image, coded); !done) return done.error();
  }
  return coded;
}

}  // namespace parhelion::station
