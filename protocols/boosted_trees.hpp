// A boosted ensemble of small trees: log-odds as a function of features.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace parhelion {

/// A tree that asks the same three questions on every path (an oblivious tree): bit k of the leaf's index is
/// features[feature[k]] > threshold[k]; NaN is not greater.
struct Tree {
  static constexpr std::size_t kDepth = 3;
  std::array<std::uint8_t, kDepth> feature{};
  std::array<float, kDepth> threshold{};
  std::array<float, 1U << kDepth> leaf{};  ///< log-odds
};

struct Trees {
  float start = 0;  ///< log-odds without any feature
  std::span<const Tree> trees;
};

/// Log-odds.
inline float evaluate(const Trees& trees, std::span<const float> features) {
  float sum = trees.start;
  for (const Tree& tree : trees.trees) {
    std::size_t leaf = 0;
    for (std::size_t k = 0; k < Tree::kDepth; ++k)
      leaf |= static_cast<std::size_t>(features[tree.feature[k]] > tree.threshold[k]) << k;
    sum += tree.leaf[leaf];
  }
  return sum;
}

/// The features of four samples at a time, for evaluate().
template <std::size_t kFeatures>
class FourSamples {
 public:
  static constexpr std::size_t kCount = 4;
  void set(std::size_t sample, const std::array<float, kFeatures>& features) {
    for (std::size_t k = 0; k < kFeatures; ++k) values_[k][sample] = features[k];
  }
  /// Adds to the log-odds of each what the trees give for it, in the order of the trees: to the bit what
  /// evaluate() gives for one sample.
  void add(std::span<const Tree> trees, std::array<float, kCount>& log_odds) const {
    static_assert(Tree::kDepth == 3, "one bit of a leaf for each level");
    Four sum = {log_odds[0], log_odds[1], log_odds[2], log_odds[3]};
    for (const Tree& tree : trees) {
      const FourBits leaf = ((values_[tree.feature[0]] > tree.threshold[0]) & 1) |
                            ((values_[tree.feature[1]] > tree.threshold[1]) & 2) |
                            ((values_[tree.feature[2]] > tree.threshold[2]) & 4);
      const float* const given = tree.leaf.data();
      sum += Four{given[leaf[0]], given[leaf[1]], given[leaf[2]], given[leaf[3]]};
    }
    for (std::size_t sample = 0; sample < kCount; ++sample) log_odds[sample] = sum[sample];
  }

 private:
  // Vectors of GCC and Clang, which compare all four at once.
  using Four = float __attribute__((vector_size(4 * sizeof(float))));
  using FourBits = std::int32_t __attribute__((vector_size(4 * sizeof(std::int32_t))));
  std::array<Four, kFeatures> values_{};
};

/// Adds to `log_odds(i)`, a float&, of each of the samples what the trees give for it, to the bit as
/// evaluate() does, in less than half of its time. `features(i)`: its std::array.
template <std::size_t kFeatures, class FeaturesOf, class LogOddsOf>
void add_to_each(std::span<const Tree> trees, std::size_t samples, FeaturesOf&& features,
                 LogOddsOf&& log_odds) {
  using Block = FourSamples<kFeatures>;
  for (std::size_t first = 0; first < samples; first += Block::kCount) {
    const std::size_t count = samples - first < Block::kCount ? samples - first : Block::kCount;
    Block block;
    std::array<float, Block::kCount> sums{};
    for (std::size_t i = 0; i < count; ++i) {
      block.set(i, features(first + i));
      sums[i] = log_odds(first + i);
    }
    block.add(trees, sums);
    for (std::size_t i = 0; i < count; ++i) log_odds(first + i) = sums[i];
  }
}

}  // namespace parhelion
