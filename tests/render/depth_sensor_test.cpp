// The model of a depth camera against the equations of a triangulating sensor.
#include "render/depth_sensor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

namespace parhelion::render {
namespace {

constexpr int kWidth = 320, kHeight = 120;
constexpr float kNothing = std::numeric_limits<float>::infinity();

DepthCameraDescription structured_light() {
  DepthCameraDescription camera;
  camera.intrinsics.width = kWidth, camera.intrinsics.height = kHeight;
  camera.intrinsics.fx = camera.intrinsics.fy = 285;
  camera.range_min = 0.4, camera.range_max = 5;
  camera.baseline = 0.075;
  camera.disparity_noise = 0.03;
  camera.disparity_step = 0.0625;
  return camera;
}

DepthPixels measure(const DepthCameraDescription& camera, const std::vector<float>& depths,
                    std::uint64_t seed = 1, std::uint64_t image = 1) {
  DepthPixels pixels{kWidth, kHeight, {}};
  DepthSensor().measure(camera, depths, seed, image, pixels);
  return pixels;
}

std::vector<float> plane(float depth) { return std::vector<float>(kWidth * kHeight, depth); }

struct Spread {
  double mean = 0, sigma = 0;
};
Spread spread_of(const DepthPixels& pixels) {
  double sum = 0, squares = 0;
  for (const auto mm : pixels.millimetres) sum += mm, squares += static_cast<double>(mm) * mm;
  const auto n = static_cast<double>(pixels.millimetres.size());
  return {sum / n / 1000, std::sqrt(squares / n - std::pow(sum / n, 2)) / 1000};
}

TEST(DepthSensor, WithoutErrorsDepthIsExactToTheMillimetre) {
  DepthCameraDescription camera = structured_light();
  camera.baseline = camera.disparity_noise = camera.disparity_step = 0;
  for (const float depth : {0.4F, 1.234F, 4.9996F}) {
    for (const auto mm : measure(camera, plane(depth)).millimetres)
      ASSERT_EQ(mm, std::lround(1000 * static_cast<double>(depth)));
  }
}

TEST(DepthSensor, DepthOutOfRangeIsNotMeasured) {
  DepthCameraDescription camera = structured_light();
  camera.baseline = camera.disparity_noise = camera.disparity_step = 0;
  for (const float depth : {0.39F, 5.01F, kNothing}) {
    for (const auto mm : measure(camera, plane(depth)).millimetres) ASSERT_EQ(mm, 0) << depth;
  }
  camera.range_max = 0;  // not given
  EXPECT_EQ(measure(camera, plane(50)).millimetres.front(), 50'000);
  EXPECT_EQ(measure(camera, plane(100)).millimetres.front(), 0);
  camera.range_max = 1000;  // more than 16 bits of millimetres
  EXPECT_EQ(measure(camera, plane(65.5F)).millimetres.front(), 65'500);
  EXPECT_EQ(measure(camera, plane(65.536F)).millimetres.front(), 0) << "and not 0.000 m of an overflow";
}

TEST(DepthSensor, StereoNoiseGrowsWithTheSquareOfTheDepth) {
  DepthCameraDescription camera = structured_light();
  camera.disparity_step = 0;
  for (const double depth : {0.8, 1.6, 3.2}) {
    const Spread spread = spread_of(measure(camera, plane(static_cast<float>(depth))));
    const double sigma = depth * depth / (285 * 0.075) * 0.03;  // Khoshelham, Elberink 2012, equation 9
    EXPECT_NEAR(spread.mean, depth, 0.001);
    EXPECT_NEAR(spread.sigma, std::hypot(sigma, 0.001 / std::sqrt(12)), 0.05 * sigma);
  }
}

TEST(DepthSensor, ValuesAreQuantisedByDisparity) {
  const DepthCameraDescription camera = structured_light();
  for (const double depth : {1.0, 2.0, 4.0}) {
    std::set<int> values;
    for (const auto mm : measure(camera, plane(static_cast<float>(depth))).millimetres) values.insert(mm);
    ASSERT_GE(values.size(), 2U);
    ASSERT_LE(values.size(), 8U) << "6 sigma are three steps";
    const double step = depth * depth / (285 * 0.075) * 0.0625;
    EXPECT_NEAR((*values.rbegin() - *values.begin()) / 1000.0, step * static_cast<double>(values.size() - 1),
                0.1 * step + 0.002);
    for (const int mm : values) {
      const double steps = 285 * 0.075 / (mm / 1000.0) / 0.0625;
      EXPECT_NEAR(steps, std::round(steps), 0.0006 / step) << mm << " mm, which is rounded";
    }
  }
}

TEST(DepthSensor, TimeOfFlightNoiseIsIndependentOfRange) {
  DepthCameraDescription camera = structured_light();
  camera.baseline = camera.disparity_noise = camera.disparity_step = 0;
  camera.noise = 0.02;
  for (const float depth : {1.F, 4.F})
    EXPECT_NEAR(spread_of(measure(camera, plane(depth))).sigma, 0.02, 0.001);
}

TEST(DepthSensor, TheStereoShadowIsTheDisparityDifferenceAtAnEdge) {
  DepthCameraDescription camera = structured_light();
  camera.disparity_noise = camera.disparity_step = 0;
  auto depths = plane(4);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 150; x < 200; ++x) depths[static_cast<std::size_t>(y * kWidth + x)] = 1;
  const DepthPixels pixels = measure(camera, depths);
  const double wide = 285 * 0.075 * (1.0 / 1 - 1.0 / 4);
  int hidden = 0;
  for (int x = 0; x < kWidth; ++x) {
    const int mm = pixels.millimetres[static_cast<std::size_t>(7 * kWidth + x)];
    if (mm == 0) {
      ++hidden;
      EXPECT_LT(x, 150);
      EXPECT_GE(x, 150 - wide - 1);
    } else {
      EXPECT_NEAR(mm, x >= 150 && x < 200 ? 1000 : 4000, 1) << x;
    }
  }
  EXPECT_NEAR(hidden, wide, 1);
}

TEST(DepthSensor, ASlantedSurfaceCastsNoStereoShadow) {
  DepthCameraDescription camera = structured_light();
  std::vector<float> depths;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) depths.push_back(1.F + 0.01F * static_cast<float>(x));  // a slanted wall
  for (const auto mm : measure(camera, depths).millimetres) ASSERT_GT(mm, 0);
}

TEST(DepthSensor, OnlyTheSameSeedGivesTheSameBytes) {
  const DepthCameraDescription camera = structured_light();
  const auto depths = plane(2.345F);
  const auto once = measure(camera, depths, 1, 1).millimetres;
  EXPECT_EQ(measure(camera, depths, 1, 1).millimetres, once);
  EXPECT_NE(measure(camera, depths, 2, 1).millimetres, once);
  EXPECT_NE(measure(camera, depths, 1, 2).millimetres, once);
}

}  // namespace
}  // namespace parhelion::render
