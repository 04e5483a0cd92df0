#include "protocols/quantile.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace parhelion {
namespace {

TEST(Quantile, LowerIsTheValueAtOrBelowDefinition7) {
  std::vector<double> values{40, 10, 30, 20};  // definition 7 gives 25 for q = 0.5, 37 for q = 0.9
  EXPECT_EQ(quantile(values, 0), 10);
  EXPECT_EQ(quantile(values, 0.5), 20);
  EXPECT_EQ(quantile(values, 0.9), 30);
  EXPECT_EQ(quantile(values, 1), 40);
}

TEST(Quantile, UpperIsDefinition1AndAtAJumpTheValueAfterIt) {
  std::vector<double> values{40, 10, 30, 20, 50};
  EXPECT_EQ(quantile(values, 0, QuantileRank::upper), 10);
  EXPECT_EQ(quantile(values, 0.5, QuantileRank::upper), 30);  // q n = 2.5
  EXPECT_EQ(quantile(values, 0.8, QuantileRank::upper), 50);  // q n = 4
  EXPECT_EQ(quantile(values, 1, QuantileRank::upper), 50);
}

TEST(Quantile, MedianIsTheUpperOfTwoInTheMiddle) {
  EXPECT_EQ(median(std::array{3, 1, 2}), 2);
  EXPECT_EQ(median(std::array{4, 3, 1, 2}), 3);
  EXPECT_EQ(median(std::vector<std::int64_t>{7}), 7);
}

TEST(Quantile, EqualsSelectionFromSortedValues) {
  std::mt19937 random(3);
  for (std::size_t n = 1; n < 200; ++n) {
    std::vector<float> values(n);
    for (float& value : values) value = std::uniform_real_distribution<float>(-1, 1)(random);
    std::vector<float> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(median(values), sorted[n / 2]);
    EXPECT_EQ(quantile(values, 0.8, QuantileRank::upper), sorted[n * 8 / 10]);
    EXPECT_EQ(quantile(values, 0.5), sorted[(n - 1) / 2]);
  }
}

TEST(Quantile, RangeEqualsBothQuantiles) {
  std::mt19937 random(5);
  for (std::size_t n = 1; n < 200; ++n) {
    std::vector<double> values(n);
    for (double& value : values) value = std::uniform_int_distribution<int>(-20, 20)(random);
    for (const auto& [low, high] : {std::pair{0.0, 1.0}, {0.01, 0.99}, {0.4, 0.5}, {0.5, 0.5}}) {
      const double first = quantile(values, low), last = quantile(values, high);
      EXPECT_EQ(quantile_range(values, low, high), std::pair(first, last));
    }
  }
}

}  // namespace
}  // namespace parhelion
