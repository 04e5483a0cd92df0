#include "server/review/pictures.hpp"

#include <algorithm>
#include <map>

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "render/jpeg.hpp"

namespace parhelion::review {
namespace {

constexpr int kWide = 480, kNarrow = 320;  // pixels, of deductions and of the strip
constexpr int kQuality = 72;

/// 3 bytes per pixel.
struct Bgr {
  int width = 0, height = 0;
  std::vector<std::uint8_t> bytes;
};

Result<Bgr> pixels_of(const Image& image, render::JpegCodec& codec) {
  Bgr out{image.width, image.height, {}};
  if (image.format == PixelFormat::mjpeg) {
    const auto format = codec.decode(image.bytes, out.bytes);
    if (!format) return format.error();
    out.width = format->width;
    out.height = format->height;
    return out;
  }
  const int channels = image.format == PixelFormat::gray ? 1 : 3;
  if (image.format == PixelFormat::depth_mm || image.row_stride < channels * image.width)
    return Error{"no picture"};
  out.bytes.resize(static_cast<std::size_t>(image.width) * image.height * 3);
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* row = image.bytes.data() + static_cast<std::size_t>(y) * image.row_stride;
    std::uint8_t* to = out.bytes.data() + static_cast<std::size_t>(y) * image.width * 3;
    for (int x = 0; x < image.width; ++x, to += 3) {
      const std::uint8_t* from = row + x * channels;
      const bool rgb = image.format == PixelFormat::rgb;
      to[0] = from[channels == 1 ? 0 : (rgb ? 2 : 0)];
      to[1] = from[channels == 1 ? 0 : 1];
      to[2] = from[channels == 1 ? 0 : (rgb ? 0 : 2)];
    }
  }
  return out;
}

/// Box filter: the mean of the pixels that each new one covers.
Bgr shrink(const Bgr& from, int width) {
  if (from.width <= width) return from;
  Bgr to{width, std::max(1, from.height * width / from.width), {}};
  to.bytes.resize(static_cast<std::size_t>(to.width) * to.height * 3);
  for (int y = 0; y < to.height; ++y) {
    const int y0 = y * from.height / to.height, y1 = std::max(y0 + 1, (y + 1) * from.height / to.height);
    for (int x = 0; x < to.width; ++x) {
      const int x0 = x * from.width / to.width, x1 = std::max(x0 + 1, (x + 1) * from.width / to.width);
      unsigned sum[3] = {};
      for (int v = y0; v < y1; ++v) {
        for (int u = x0; u < x1; ++u) {
          const std::uint8_t* pixel = &from.bytes[(static_cast<std::size_t>(v) * from.width + u) * 3];
          for (int c = 0; c < 3; ++c) sum[c] += pixel[c];
        }
      }
      const unsigned count = static_cast<unsigned>((y1 - y0) * (x1 - x0));
      for (int c = 0; c < 3; ++c)
        to.bytes[(static_cast<std::size_t>(y) * to.width + x) * 3 + static_cast<std::size_t>(c)] =
            static_cast<std::uint8_t>((sum[c] + count / 2) / count);
    }
  }
  return to;
}

Result<Picture> picture_of(double t, const std::vector<std::uint8_t>& message, int width,
                           render::JpegCodec& codec) {
  Image image;
  if (const Status read = decode(channel::kMrCamera, message, image); !read) return read.error();
  const auto pixels = pixels_of(image, codec);
  if (!pixels) return pixels.error();
  const Bgr small = shrink(*pixels, width);
  auto jpeg = codec.encode(small.bytes, {small.width, small.height, kQuality, {}});
  if (!jpeg) return jpeg.error();
  return Picture{t, small.width, small.height, std::move(*jpeg)};
}

}  // namespace

void PictureChoice::saw(double t, std::vector<std::uint8_t>&& message) {
  ++seen_;
  last_ = std::make_shared<const Frame>(Frame{t, std::move(message)});
  if (t < strip_next_) return;
  strip_.push_back(last_);
  strip_next_ = t + strip_interval_;
  if (strip_.size() <= 2 * max_strip_) return;
  strip_interval_ *= 2;
  std::vector<std::shared_ptr<const Frame>> fewer;
  for (std::size_t i = 0; i < strip_.size(); i += 2) fewer.push_back(strip_[i]);
  strip_ = std::move(fewer);
  strip_next_ = strip_.back()->t + strip_interval_;
}

void PictureChoice::handle_deduction(double points) {
  if (!last_) return;
  deduction_pictures_.push_back({points, last_});
  if (deduction_pictures_.size() <= max_deductions_) return;
  // Drops the smallest deduction, and of equal ones the latest.
  auto cheapest = deduction_pictures_.begin();
  for (auto each = deduction_pictures_.begin(); each != deduction_pictures_.end(); ++each)
    if (each->points <= cheapest->points) cheapest = each;
  deduction_pictures_.erase(cheapest);
}

std::vector<Picture> PictureChoice::finish(std::uint64_t& unreadable) const {
  std::map<const Frame*, int> widths;
  std::vector<const Frame*> frames;
  const auto choose = [&](const Frame* frame, int width) {
    if (widths.try_emplace(frame, width).second) frames.push_back(frame);
  };
  for (const DeductionPicture& each : deduction_pictures_) choose(each.frame.get(), kWide);
  for (const auto& each : strip_) choose(each.get(), kNarrow);
  std::stable_sort(frames.begin(), frames.end(), [](const Frame* a, const Frame* b) { return a->t < b->t; });
  render::JpegCodec codec;
  std::vector<Picture> pictures;
  unreadable = 0;
  for (const Frame* frame : frames) {
    auto picture = picture_of(frame->t, frame->message, widths.at(frame), codec);
    if (picture)
      pictures.push_back(std::move(*picture));
    else
      ++unreadable;
  }
  return pictures;
}

}  // namespace parhelion::review
