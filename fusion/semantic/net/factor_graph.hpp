// A small pairwise factor graph over labels, with scores for each variable and for each pair.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <utility>
#include <vector>

namespace parhelion::semantic {

/// Scores are natural logarithms; adding a constant to a variable's or pair's scores changes nothing.
class FactorGraph {
 public:
  /// A variable with one score per label; its index.
  std::size_t add_variable(Eigen::VectorXd scores);
  /// `scores(i, j)`: label i of `a` together with label j of `b`. a != b.
  void add_pair(std::size_t a, std::size_t b, Eigen::MatrixXd scores);

  /// Variables with one label each that may only improve the score together: `solve` tries them at once.
  using Proposal = std::vector<std::pair<std::size_t, std::size_t>>;
  void propose(Proposal proposal);

  std::size_t size() const { return unary_.size(); }

  struct Solution {
    std::vector<std::size_t> labels;       ///< of the assignment, one per variable
    std::vector<Eigen::VectorXd> beliefs;  ///< per variable and label, each sums to 1
    double score = 0;                      ///< of the assignment
  };

  /// Loopy sum-product for the beliefs (Pearl 1988; exact on trees), then a local search that starts from the
  /// most probable labels and changes one variable, one pair or one proposal at a time until no change
  /// improves the score. Deterministic.
  Solution solve() const;

  /// Reference implementation: tries every assignment, for at most a few million.
  Solution enumerate() const;

  double score(const std::vector<std::size_t>& labels) const;

 private:
  struct Pair {
    std::size_t a, b;
    Eigen::MatrixXd scores;
  };
  std::vector<Eigen::VectorXd> propagate() const;
  void climb(std::vector<std::size_t>& labels) const;
  double gain(const std::vector<std::size_t>& labels, std::size_t variable, std::size_t label) const;

  std::vector<Eigen::VectorXd> unary_;
  std::vector<Pair> pairs_;
  std::vector<Proposal> proposals_;
  std::vector<std::vector<std::size_t>> pairs_of_;  ///< per variable: its pairs
};

}  // namespace parhelion::semantic
