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

}  // namespace parhelion
