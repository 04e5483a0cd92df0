#include "cameras.hpp"

#include <cmath>

#include "description.hpp"

namespace robot {
namespace {

constexpr std::int32_t kRgb = 859981650, kDepthMillimetres = 540422490;  // as image_t.lcm has them

parhelion::image_t empty_image(std::int64_t utime, std::int32_t format, int bytes_per_pixel) {
  parhelion::image_t image{};
  image.utime = utime;
  image.width = kImageWidth;
  image.height = kImageHeight;
  image.row_stride = kImageWidth * bytes_per_pixel;
  image.pixelformat = format;
  image.size = image.row_stride * kImageHeight;
  image.data.reserve(static_cast<std::size_t>(image.size));
  return image;
}

// "encoding" of a depth image says how its bytes are packed.
void mark_raw(parhelion::image_t& depth) {
  parhelion::image_metadata_t encoding;
  encoding.key = "encoding";
  encoding.value = {'r', 'a', 'w'};
  encoding.n = 3;
  depth.metadata.push_back(encoding);
  depth.nmetadata = 1;
}

}  // namespace

Images take_images(const Building& building, const ArmPosture& arm, const Pose2& T_site_base,
                   std::int64_t utime) {
  const std::vector<LinkBox> links = link_boxes(arm);
  Images images{empty_image(utime, kRgb, 3), empty_image(utime, kDepthMillimetres, 2)};
  mark_raw(images.depth);
  const Point2 eye = T_site_base * Point2{kCameraX, 0};
  const double c = std::cos(T_site_base.yaw), s = std::sin(T_site_base.yaw);
  for (int row = 0; row < kImageHeight; ++row) {
    for (int column = 0; column < kImageWidth; ++column) {
      // Forward 1, left, up: the ray through the middle of the pixel.
      const double left = ((kImageWidth - 1) / 2.0 - column) / kFocalLength;
      const double up = ((kImageHeight - 1) / 2.0 - row) / kFocalLength;
      const double length = std::sqrt(1 + left * left + up * up);
      Hit hit = building.cast({eye.x, eye.y, kCameraHeight},
                              {(c - s * left) / length, (s + c * left) / length, up / length}, 100);
      const Hit own = cast(links, {kCameraX, 0, kCameraHeight}, {1 / length, left / length, up / length});
      if (own.range < hit.range) hit = own;
      for (const std::uint8_t value : {hit.colour.red, hit.colour.green, hit.colour.blue})
        images.colour.data.push_back(value);
      const double depth = hit.range / length;
      const bool measured = depth >= kDepthMin && depth < kDepthMax;
      const auto millimetres = static_cast<std::uint16_t>(measured ? std::lround(1000 * depth) : 0);
      images.depth.data.push_back(static_cast<std::uint8_t>(millimetres & 0xFF));
      images.depth.data.push_back(static_cast<std::uint8_t>(millimetres >> 8));
    }
  }
  return images;
}

}  // namespace robot
