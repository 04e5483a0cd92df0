#include "server/station/depth_frames.hpp"

#include <gtest/gtest.h>

#include "tests/number_at.hpp"

namespace parhelion::station {
namespace {

using test::number_at;

DepthCameraDescription camera(int width, int height) {
  DepthCameraDescription made;
  made.intrinsics.width = width;
  made.intrinsics.height = height;
  made.intrinsics.fx = made.intrinsics.fy = 100;
  made.intrinsics.cx = made.intrinsics.cy = 0;
  made.range_max = 8;
  return made;
}

render::DepthPixels wall(int width, int height) {
  return {width, height, std::vector<std::uint16_t>(static_cast<std::size_t>(width * height), 2000)};
}

std::uint32_t count(const std::string& bytes) { return number_at<std::uint32_t>(bytes, 4); }

TEST(DepthFrames, LensDistortionIsCorrected) {
  auto bent = camera(101, 1);
  bent.intrinsics.distortion = {-0.16, 0.03, 0, 0, 0};
  const auto bytes = depth_bytes(wall(101, 1), bent, {}, 1.5);
  ASSERT_EQ(count(bytes), 101U);
  EXPECT_EQ(number_at<std::uint16_t>(bytes, 2), 0U) << "no colours";
  // Column 100 is seen at 1: a ray of x has r = x (1 - 0.16 x^2 + 0.03 x^4) there.
  const double x = number_at<float>(bytes, 16 + 16 * 100) / 2.0;
  EXPECT_NEAR(x * (1 - 0.16 * x * x + 0.03 * x * x * x * x), 1, 1e-5);
  EXPECT_GT(x, 1.1);
  EXPECT_NEAR(number_at<float>(bytes, 16 + 16 * 100 + 8), 2, 1e-6);
}

TEST(DepthFrames, TheRequestedNumberOfPointsIsSpreadOverTheImage) {
  for (const auto& [width, height] : {std::pair{320, 240}, {640, 480}, {5000, 1}, {3, 3}}) {
    const auto n = count(depth_bytes(wall(width, height), camera(width, height), {}, 0, 800));
    EXPECT_LE(n, 800U) << width;
    EXPECT_GE(n, std::min(width * height, 400)) << width;
  }
}

TEST(DepthFrames, AnUnsetMaximumRangeExcludesNoPoints) {
  auto far = camera(2, 1);
  far.range_max = 0;
  EXPECT_EQ(count(depth_bytes(wall(2, 1), far, {}, 0)), 2U);
  far.range_max = 1.5;
  EXPECT_EQ(count(depth_bytes(wall(2, 1), far, {}, 0)), 0U);
}

TEST(DepthFrames, AnImageOfAWrongSizeIsRefused) {
  EXPECT_EQ(count(depth_bytes(wall(4, 3), camera(3, 4), {}, 0)), 0U);
  EXPECT_EQ(count(depth_bytes(wall(4, 3), camera(8, 6), {}, 0)), 0U);
}

}  // namespace
}  // namespace parhelion::station
