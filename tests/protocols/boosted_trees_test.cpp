#include "protocols/boosted_trees.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "protocols/splitmix64.hpp"

namespace parhelion {
namespace {

constexpr std::size_t kFeatures = 7;

/// In eighths from -4 to 4, so that features meet thresholds.
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : state_(seed) {}
  std::size_t below(std::size_t n) {
    return static_cast<std::size_t>(splitmix64(state_ += kSplitMix64Increment) % n);
  }
  float number() { return (static_cast<float>(below(65)) - 32) / 8; }

 private:
  std::uint64_t state_;
};

std::vector<Tree> random_trees(Numbers& numbers, std::size_t n) {
  std::vector<Tree> trees(n);
  for (Tree& tree : trees) {
    for (std::uint8_t& feature : tree.feature) feature = static_cast<std::uint8_t>(numbers.below(kFeatures));
    for (float& threshold : tree.threshold) threshold = numbers.number();
    // Thirds: sums depend on the order.
    for (float& leaf : tree.leaf) leaf = numbers.number() / 3;
  }
  return trees;
}

TEST(BoostedTrees, give_each_of_many_samples_the_same_bits_as_one_by_one) {
  for (std::size_t samples = 0; samples < 30; ++samples) {
    Numbers numbers(samples);
    const std::vector<Tree> trees = random_trees(numbers, 50);
    std::vector<std::array<float, kFeatures>> features(samples);
    for (auto& each : features)
      for (float& value : each)
        value = numbers.below(20) == 0 ? std::numeric_limits<float>::quiet_NaN() : numbers.number();
    std::vector<float> log_odds(samples);
    for (float& each : log_odds) each = numbers.number();
    const std::vector<float> start = log_odds;
    add_to_each<kFeatures>(
        trees, samples, [&](std::size_t i) -> const auto& { return features[i]; },
        [&](std::size_t i) -> float& { return log_odds[i]; });
    for (std::size_t i = 0; i < samples; ++i)
      EXPECT_EQ(log_odds[i], evaluate({start[i], trees}, features[i])) << i << " of " << samples;
  }
}

}  // namespace
}  // namespace parhelion
