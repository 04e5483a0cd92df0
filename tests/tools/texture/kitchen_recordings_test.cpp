// A real kitchen: what its texture shows where images were held back.
#include <gtest/gtest.h>

#include <numbers>
#include <opencv2/imgcodecs.hpp>

#include "fusion/semantic/texture/build_texture.hpp"
#include "render/colour_image.hpp"
#include "render/depth_image.hpp"
#include "render/textured_camera.hpp"
#include "tests/picture_quality.hpp"
#include "tests/render/kitchen.hpp"

namespace parhelion::semantic {
namespace {

using test::Kitchen;

/// At least this from every image that goes in.
constexpr double kDistance = 0.3, kAngle = 15 * std::numbers::pi / 180;

bool is_far(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::Isometry3d between = a.inverse(Eigen::Isometry) * b;
  return between.translation().norm() >= kDistance || Eigen::AngleAxisd(between.linear()).angle() >= kAngle;
}

Pinhole pinhole_of(const CameraIntrinsics& c) { return {c.width, c.height, c.fx, c.fy, c.cx, c.cy}; }

struct Frames {
  std::vector<ColourView> colour;
  std::vector<DepthView> depth;
};

Frames frames_far_from(const Kitchen& kitchen, const render::RenderJob& held) {
  Frames frames;
  for (int i = 0; i < 100; i += 2) {
    const render::RenderJob job = kitchen.job(i, {});
    if (!is_far(held.T_map_optical.isometry(), job.T_map_optical.isometry())) continue;
    frames.colour.push_back(
        {pinhole_of(job.camera.intrinsics), job.T_map_optical, render::decode_colour(job.image)->rgb});
    frames.depth.push_back({pinhole_of(job.depth_camera.intrinsics), job.T_map_depth,
                            render::decode_depth(*job.depth)->millimetres});
  }
  return frames;
}

/// Where the texture shows something: a picture of a white one is white there.
cv::Mat shown(const BuiltTexture& built, const render::RenderJob& held) {
  BuiltTexture white = built;
  std::fill(white.rgb.begin(), white.rgb.end(), std::uint8_t{255});
  white.texture.exposure = {};
  render::JpegCodec codec;
  white.texture.jpeg = *codec.encode(white.rgb, {white.width, white.height, 92});
  const auto camera = render::create_virtual_camera({}, &white.texture);
  const Image image = (*camera)->render(held.camera, held.T_map_optical, {}, {}, "");
  return cv::imdecode(image.bytes, cv::IMREAD_GRAYSCALE) > 200;
}

TEST(TextureOfTheKitchen, ShowsHeldBackImages) {
  const Kitchen kitchen;
  PARHELION_NEEDS_RECORDING(kitchen.folder);
  double psnr = 0, ssim = 0;
  for (const int frame : {36, 84}) {
    const render::RenderJob held = kitchen.job(frame, {});
    const Frames frames = frames_far_from(kitchen, held);
    auto built = build_texture({}, frames.colour, frames.depth);
    ASSERT_TRUE(built) << built.error().message;
    std::vector<std::uint8_t> bgr = built->rgb;
    for (std::size_t i = 0; i + 2 < bgr.size(); i += 3) std::swap(bgr[i], bgr[i + 2]);
    render::JpegCodec codec;
    built->texture.jpeg =
        *codec.encode(bgr, {built->width, built->height, 92, render::JpegFormat::Subsampling::yuv444});
    const auto camera = render::create_virtual_camera({}, &built->texture);
    ASSERT_TRUE(camera.ok()) << camera.error().message;
    const Image image = (*camera)->render(held.camera, held.T_map_optical, {}, {}, "");
    const cv::Mat drawn = cv::imdecode(image.bytes, cv::IMREAD_COLOR);
    const cv::Mat real = cv::imdecode(held.image.bytes, cv::IMREAD_COLOR);
    const cv::Mat mask = shown(*built, held);
    EXPECT_GT(cv::mean(mask)[0] / 255, 0.7) << frame;
    psnr += test::psnr(real, drawn, mask) / 2;
    ssim += test::ssim(real, drawn, mask) / 2;
  }
  EXPECT_GT(psnr, 18.0);
  EXPECT_GT(ssim, 0.60);
}

}  // namespace
}  // namespace parhelion::semantic
