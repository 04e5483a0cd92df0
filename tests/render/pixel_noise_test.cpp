// The noise of a simulated camera.
#include "render/pixel_noise.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace parhelion::render {
namespace {

TEST(PixelNoise, EqualsTheReferenceForAnyLength) {
  const PixelNoise noise(3);
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{6}, std::size_t{4099}}) {
    std::vector<std::uint8_t> values(size), expected(size);
    for (std::size_t i = 0; i < size; ++i) {
      values[i] = static_cast<std::uint8_t>(i * 37);
      expected[i] = static_cast<std::uint8_t>(std::clamp(values[i] + noise.at(5, 9, i), 0, 255));
    }
    noise.add(5, 9, values);
    EXPECT_EQ(values, expected) << size;
  }
}

TEST(PixelNoise, HasTheRequestedSigmaAndNoBias) {
  for (const double sigma : {0.7, 1.5, 8.0}) {
    const PixelNoise noise(sigma);
    std::vector<std::uint8_t> values(500'000, 128);
    noise.add(1, 2, values);
    double sum = 0, squares = 0, neighbours = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double e = values[i] - 128.0;
      sum += e;
      squares += e * e;
      if (i > 0) neighbours += e * (values[i - 1] - 128.0);
    }
    const double count = static_cast<double>(values.size());
    EXPECT_NEAR(sum / count, 0, 4 * sigma / std::sqrt(count));
    EXPECT_NEAR(squares / count, sigma * sigma + 1.0 / 12, 0.02 * sigma * sigma + 0.01) << "rounded";
    EXPECT_NEAR(neighbours / squares, 0, 0.01) << "white";
  }
}

TEST(PixelNoise, DependsOnSeedAndImage) {
  const PixelNoise noise(3);
  const auto of = [&noise](std::uint64_t seed, std::uint64_t image) {
    std::vector<std::uint8_t> values(1000, 128);
    noise.add(seed, image, values);
    return values;
  };
  EXPECT_EQ(of(1, 1), of(1, 1));
  EXPECT_NE(of(1, 1), of(1, 2));
  EXPECT_NE(of(1, 1), of(2, 1));
}

}  // namespace
}  // namespace parhelion::render
