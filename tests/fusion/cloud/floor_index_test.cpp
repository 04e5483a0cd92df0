#include "fusion/cloud/floor_index.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace parhelion::cloud {
namespace {

TEST(FloorIndex, IsTheFloor) {
  for (const double middle :
       {0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 1e-300, -1e-300, 2147483646.0, -2147483647.0}) {
    for (const double v : {middle, std::nextafter(middle, 1e300), std::nextafter(middle, -1e300)})
      EXPECT_EQ(floor_index(v), static_cast<int>(std::floor(v))) << v;
  }
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> anywhere(-2e9, 2e9), near(-3, 3);
  for (int i = 0; i < 100'000; ++i) {
    const double a = anywhere(random), b = near(random);
    ASSERT_EQ(floor_index(a), static_cast<int>(std::floor(a)));
    ASSERT_EQ(floor_index(b), static_cast<int>(std::floor(b)));
  }
}

}  // namespace
}  // namespace parhelion::cloud
