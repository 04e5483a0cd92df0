// Trains boosted trees and writes them as source. Gradient boosting of oblivious trees (Friedman 2001,
// Prokhorenkova et al. 2018) with Newton steps.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numeric>
#include <ostream>
#include <string>
#include <vector>

#include "protocols/boosted_trees.hpp"

namespace parhelion::test {

/// Rows of features, each with its label.
struct Samples {
  std::size_t features = 0;
  std::vector<float> values;  ///< row by row
  std::vector<char> label;    ///< 1: positive
  std::size_t size() const { return label.size(); }
  float at(std::size_t i, std::size_t f) const { return values[i * features + f]; }
  template <class Row>
  void add(const Row& row, bool positive) {
    features = row.size();
    values.insert(values.end(), row.begin(), row.end());
    label.push_back(positive ? 1 : 0);
  }
};

struct TrainedTrees {
  float start = 0;
  std::vector<Tree> trees;
  Trees view() const { return {start, trees}; }
};

class Boosting {
 public:
  static constexpr std::size_t kBins = 40;
  static constexpr double kRate = 0.25, kRegularization = 5;

  explicit Boosting(const Samples& samples) : samples_(samples) {
    for (std::size_t f = 0; f < samples.features; ++f) add_thresholds(f);
    bins_.resize(samples.values.size());
    for (std::size_t f = 0; f < samples.features; ++f) {
      const auto& t = thresholds_[f];
      for (std::size_t i = 0; i < samples.size(); ++i) {
        bins_[f * samples.size() + i] =
            static_cast<std::uint8_t>(std::lower_bound(t.begin(), t.end(), samples.at(i, f)) - t.begin());
      }
    }
  }

  TrainedTrees train(std::size_t trees) {
    TrainedTrees model;
    const double positive = std::accumulate(samples_.label.begin(), samples_.label.end(), 0.0);
    const auto n = static_cast<double>(samples_.size());
    model.start = static_cast<float>(std::log(positive / (n - positive)));
    sum_.assign(samples_.size(), double{model.start});
    for (std::size_t k = 0; k < trees; ++k) model.trees.push_back(grow());
    return model;
  }

 private:
  void add_thresholds(std::size_t f) {
    std::vector<float> all;
    for (std::size_t i = 0; i < samples_.size(); i += 1 + samples_.size() / 20000)
      all.push_back(samples_.at(i, f));
    std::sort(all.begin(), all.end());
    std::vector<float> t;
    for (std::size_t b = 1; b < kBins; ++b) {
      const float value = all[all.size() * b / kBins];
      if (t.empty() || value > t.back()) t.push_back(value);
    }
    thresholds_.push_back(t);
  }

  Tree grow() {
    const std::size_t n = samples_.size();
    std::vector<double> gradient(n), hessian(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double p = 1 / (1 + std::exp(-sum_[i]));
      gradient[i] = samples_.label[i] - p;
      hessian[i] = std::max(p * (1 - p), 1e-6);
    }
    Tree tree;
    std::vector<std::uint8_t> leaf(n, 0);
    for (std::size_t level = 0; level < Tree::kDepth; ++level) split(level, gradient, hessian, leaf, tree);
    double g[1U << Tree::kDepth] = {}, h[1U << Tree::kDepth] = {};
    for (std::size_t i = 0; i < n; ++i) {
      g[leaf[i]] += gradient[i];
      h[leaf[i]] += hessian[i];
    }
    for (std::size_t l = 0; l < tree.leaf.size(); ++l)
      tree.leaf[l] = static_cast<float>(kRate * g[l] / (h[l] + kRegularization));
    for (std::size_t i = 0; i < n; ++i) sum_[i] += double{tree.leaf[leaf[i]]};
    return tree;
  }

  void split(std::size_t level, const std::vector<double>& gradient, const std::vector<double>& hessian,
             std::vector<std::uint8_t>& leaf, Tree& tree) const {
    const std::size_t n = samples_.size();
    double best = -1;
    std::size_t best_bin = 0, best_feature = 0;
    const std::size_t leaves = std::size_t{1} << level;
    std::vector<double> g(leaves * kBins), h(leaves * kBins);
    for (std::size_t f = 0; f < samples_.features; ++f) {
      std::fill(g.begin(), g.end(), 0);
      std::fill(h.begin(), h.end(), 0);
      const std::uint8_t* const bins = bins_.data() + f * n;
      for (std::size_t i = 0; i < n; ++i) {
        const std::size_t cell = leaf[i] * kBins + bins[i];
        g[cell] += gradient[i];
        h[cell] += hessian[i];
      }
      for (std::size_t b = 0; b < thresholds_[f].size(); ++b) {
        double gain = 0;
        for (std::size_t l = 0; l < leaves; ++l) {
          double gl = 0, hl = 0, gr = 0, hr = 0;
          for (std::size_t k = 0; k < kBins; ++k) {
            (k <= b ? gl : gr) += g[l * kBins + k];
            (k <= b ? hl : hr) += h[l * kBins + k];
          }
          gain += gl * gl / (hl + kRegularization) + gr * gr / (hr + kRegularization);
        }
        if (gain > best) {
          best = gain;
          best_bin = b;
          best_feature = f;
        }
      }
    }
    tree.feature[level] = static_cast<std::uint8_t>(best_feature);
    tree.threshold[level] = thresholds_[best_feature][best_bin];
    for (std::size_t i = 0; i < n; ++i)
      leaf[i] |= static_cast<std::uint8_t>((bins_[best_feature * n + i] > best_bin ? 1U : 0U) << level);
  }

  const Samples& samples_;
  std::vector<std::vector<float>> thresholds_;
  std::vector<std::uint8_t> bins_;  // of each sample, feature by feature
  std::vector<double> sum_;
};

inline std::string number_text(float value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", double{value});
  std::string result = text;
  if (result.find_first_of(".e") == std::string::npos) result += ".0";
  return result + "F";
}

/// The trees as rows of an array of Tree.
inline void write_trees(std::ostream& file, const std::vector<Tree>& trees) {
  for (const Tree& tree : trees) {
    file << "  {{";
    for (std::size_t k = 0; k < Tree::kDepth; ++k) file << (k ? ", " : "") << int{tree.feature[k]};
    file << "}, {";
    for (std::size_t k = 0; k < Tree::kDepth; ++k) file << (k ? ", " : "") << number_text(tree.threshold[k]);
    file << "},\n   {";
    for (std::size_t k = 0; k < tree.leaf.size(); ++k) file << (k ? ", " : "") << number_text(tree.leaf[k]);
    file << "}},\n";
  }
}

}  // namespace parhelion::test
