#include "render/colour_image.hpp"

#include <algorithm>
#include <cmath>

#include "render/pixels.hpp"

namespace parhelion::render {
namespace {

constexpr double kLonger = 1.03;
constexpr int kAttempts = 60;

PinholeView pinhole(const CameraIntrinsics& c, double scale) {
  PinholeView view;
  view.fx = scale * c.fx, view.fy = scale * c.fy, view.cx = c.cx, view.cy = c.cy;
  view.width = c.width, view.height = c.height;
  return view;
}

std::optional<Eigen::Vector2d> source_of(const Lens& lens, const PinholeView& view, int x, int y) {
  const auto pixel = lens.project({(x - view.cx) / view.fx, (y - view.cy) / view.fy, 1});
  const bool inside = pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() <= view.width - 1 &&
                      pixel->y() <= view.height - 1;
  return inside ? pixel : std::nullopt;
}

/// Whether the border of the view lies in the image.
bool is_filled(const Lens& lens, const PinholeView& view) {
  for (int x = 0; x < view.width; ++x)
    if (!source_of(lens, view, x, 0) || !source_of(lens, view, x, view.height - 1)) return false;
  for (int y = 0; y < view.height; ++y)
    if (!source_of(lens, view, 0, y) || !source_of(lens, view, view.width - 1, y)) return false;
  return true;
}

}  // namespace

Result<ColourPixels> decode_colour(const Image& image) {
  JpegCodec codec;
  BgrFrame frame;
  if (const Status status = read_pixels(image, codec, frame); !status) return status.error();
  ColourPixels pixels{frame.width, frame.height, std::move(frame.bgr)};
  for (std::size_t i = 0; i + 2 < pixels.rgb.size(); i += 3) std::swap(pixels.rgb[i], pixels.rgb[i + 2]);
  return pixels;
}

Unwarp unwarp(const CameraIntrinsics& intrinsics) {
  Unwarp result{pinhole(intrinsics, 1), {}};
  const Lens lens(intrinsics);
  if (lens.undistorted()) return result;
  double scale = 1;
  for (int attempt = 0; attempt < kAttempts && !is_filled(lens, result.view); ++attempt)
    result.view = pinhole(intrinsics, scale *= kLonger);
  for (int y = 0; y < intrinsics.height; ++y) {
    for (int x = 0; x < intrinsics.width; ++x) {
      const auto pixel = source_of(lens, result.view, x, y);
      result.source.push_back(pixel ? pixel->cast<float>() : Eigen::Vector2f(0, 0));
    }
  }
  return result;
}

ColourPixels unwarped(ColourPixels pixels, const Unwarp& unwarp) {
  if (unwarp.source.empty()) return pixels;
  ColourPixels result{pixels.width, pixels.height, std::vector<std::uint8_t>(pixels.rgb.size())};
  const auto row = 3 * static_cast<std::size_t>(pixels.width);
  for (std::size_t i = 0; i < unwarp.source.size(); ++i) {
    const Eigen::Vector2f& at = unwarp.source[i];
    const int x = std::min(static_cast<int>(at.x()), pixels.width - 2);
    const int y = std::min(static_cast<int>(at.y()), pixels.height - 2);
    const float s = at.x() - static_cast<float>(x), t = at.y() - static_cast<float>(y);
    const std::uint8_t* p = &pixels.rgb[static_cast<std::size_t>(y) * row + 3 * static_cast<std::size_t>(x)];
    for (std::size_t c = 0; c < 3; ++c) {
      const float top = (1 - s) * p[c] + s * p[c + 3], bottom = (1 - s) * p[row + c] + s * p[row + c + 3];
      result.rgb[3 * i + c] = static_cast<std::uint8_t>(std::lround((1 - t) * top + t * bottom));
    }
  }
  return result;
}

std::vector<std::uint16_t> unwarped(std::vector<std::uint16_t> depth, int width, const Unwarp& unwarp) {
  if (unwarp.source.empty()) return depth;
  std::vector<std::uint16_t> result(depth.size());
  for (std::size_t i = 0; i < unwarp.source.size(); ++i) {
    const auto x = static_cast<std::size_t>(std::lround(unwarp.source[i].x()));
    const auto y = static_cast<std::size_t>(std::lround(unwarp.source[i].y()));
    result[i] = depth[y * static_cast<std::size_t>(width) + x];
  }
  return result;
}

}  // namespace parhelion::render
