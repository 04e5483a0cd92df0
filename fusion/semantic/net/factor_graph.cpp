#include "fusion/semantic/net/factor_graph.hpp"

#include <cassert>
#include <cmath>
#include <limits>

namespace parhelion::semantic {
namespace {

constexpr int kRounds = 60;
constexpr double kDamping = 0.5;   ///< fraction of the old message that is kept, against oscillation
constexpr double kSettled = 1e-9;  ///< largest change of a message at convergence

/// exp(scores), scaled to sum 1.
Eigen::VectorXd normalized_exp(const Eigen::VectorXd& scores) {
  const Eigen::VectorXd e = (scores.array() - scores.maxCoeff()).exp();
  return e / e.sum();
}

std::size_t argmax(const Eigen::VectorXd& v) {
  Eigen::Index at = 0;
  v.maxCoeff(&at);
  return static_cast<std::size_t>(at);
}

Eigen::Index index(std::size_t i) { return static_cast<Eigen::Index>(i); }

}  // namespace

std::size_t FactorGraph::add_variable(Eigen::VectorXd scores) {
  assert(scores.size() > 0 && scores.allFinite());
  unary_.push_back(std::move(scores));
  pairs_of_.emplace_back();
  return unary_.size() - 1;
}

void FactorGraph::add_pair(std::size_t a, std::size_t b, Eigen::MatrixXd scores) {
  assert(a != b && a < size() && b < size() && scores.allFinite());
  assert(scores.rows() == unary_[a].size() && scores.cols() == unary_[b].size());
  pairs_of_[a].push_back(pairs_.size());
  pairs_of_[b].push_back(pairs_.size());
  pairs_.push_back({a, b, std::move(scores)});
}

void FactorGraph::propose(Proposal proposal) {
  for ([[maybe_unused]] const auto& [variable, label] : proposal)
    assert(variable < size() && label < static_cast<std::size_t>(unary_[variable].size()));
  proposals_.push_back(std::move(proposal));
}

double FactorGraph::score(const std::vector<std::size_t>& labels) const {
  double sum = 0;
  for (std::size_t i = 0; i < size(); ++i) sum += unary_[i](index(labels[i]));
  for (const Pair& pair : pairs_) sum += pair.scores(index(labels[pair.a]), index(labels[pair.b]));
  return sum;
}

std::vector<Eigen::VectorXd> FactorGraph::propagate() const {
  // Log messages: towards b and towards a of each pair.
  std::vector<Eigen::VectorXd> to_b, to_a;
  for (const Pair& pair : pairs_) {
    to_b.push_back(Eigen::VectorXd::Zero(pair.scores.cols()));
    to_a.push_back(Eigen::VectorXd::Zero(pair.scores.rows()));
  }
  const auto incoming = [&](std::size_t variable, std::size_t except) {
    Eigen::VectorXd sum = unary_[variable];
    for (const std::size_t p : pairs_of_[variable]) {
      if (p != except) sum += pairs_[p].b == variable ? to_b[p] : to_a[p];
    }
    return sum;
  };
  const auto message = [](const Eigen::MatrixXd& scores, const Eigen::VectorXd& from) {
    Eigen::VectorXd to(scores.cols());
    for (Eigen::Index j = 0; j < scores.cols(); ++j) {
      const Eigen::ArrayXd terms = scores.col(j).array() + from.array();
      const double top = terms.maxCoeff();
      to(j) = top + std::log((terms - top).exp().sum());
    }
    return Eigen::VectorXd(to.array() - to.maxCoeff());
  };
  for (int round = 0; round < kRounds; ++round) {
    double change = 0;
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
      const Eigen::VectorXd b = message(pairs_[p].scores, incoming(pairs_[p].a, p));
      const Eigen::VectorXd a = message(pairs_[p].scores.transpose(), incoming(pairs_[p].b, p));
      change = std::max({change, (b - to_b[p]).cwiseAbs().maxCoeff(), (a - to_a[p]).cwiseAbs().maxCoeff()});
      to_b[p] = kDamping * to_b[p] + (1 - kDamping) * b;
      to_a[p] = kDamping * to_a[p] + (1 - kDamping) * a;
    }
    if (change < kSettled) break;
  }
  std::vector<Eigen::VectorXd> beliefs;
  for (std::size_t i = 0; i < size(); ++i) beliefs.push_back(normalized_exp(incoming(i, pairs_.size())));
  return beliefs;
}

double FactorGraph::gain(const std::vector<std::size_t>& labels, std::size_t variable,
                         std::size_t label) const {
  const std::size_t old = labels[variable];
  double sum = unary_[variable](index(label)) - unary_[variable](index(old));
  for (const std::size_t p : pairs_of_[variable]) {
    const Pair& pair = pairs_[p];
    sum += pair.a == variable ? pair.scores(index(label), index(labels[pair.b])) -
                                    pair.scores(index(old), index(labels[pair.b]))
                              : pair.scores(index(labels[pair.a]), index(label)) -
                                    pair.scores(index(labels[pair.a]), index(old));
  }
  return sum;
}

void FactorGraph::climb(std::vector<std::size_t>& labels) const {
  constexpr double kBetter = 1e-12;
  for (bool better = true; better;) {
    better = false;
    for (std::size_t i = 0; i < size(); ++i) {
      for (std::size_t label = 0; label < static_cast<std::size_t>(unary_[i].size()); ++label) {
        if (gain(labels, i, label) <= kBetter) continue;
        labels[i] = label;
        better = true;
      }
    }
    for (const Pair& pair : pairs_) {
      const std::size_t a = labels[pair.a], b = labels[pair.b];
      double best = kBetter;
      std::size_t best_a = a, best_b = b;
      for (std::size_t i = 0; i < static_cast<std::size_t>(pair.scores.rows()); ++i) {
        labels[pair.a] = a;
        const double first = gain(labels, pair.a, i);
        labels[pair.a] = i;
        for (std::size_t j = 0; j < static_cast<std::size_t>(pair.scores.cols()); ++j) {
          const double both = first + gain(labels, pair.b, j);
          if (both > best) best = both, best_a = i, best_b = j;
        }
      }
      labels[pair.a] = best_a;
      labels[pair.b] = best_b;
      better = better || best_a != a || best_b != b;
    }
  }
}

FactorGraph::Solution FactorGraph::solve() const {
  Solution solution;
  solution.beliefs = propagate();
  for (const Eigen::VectorXd& belief : solution.beliefs) solution.labels.push_back(argmax(belief));
  climb(solution.labels);
  solution.score = score(solution.labels);
  for (const Proposal& proposal : proposals_) {
    std::vector<std::size_t> labels = solution.labels;
    for (const auto& [variable, label] : proposal) labels[variable] = label;
    if (labels == solution.labels) continue;
    climb(labels);
    const double other = score(labels);
    if (other > solution.score) solution.score = other, solution.labels = std::move(labels);
  }
  return solution;
}

FactorGraph::Solution FactorGraph::enumerate() const {
  Solution solution;
  for (const Eigen::VectorXd& unary : unary_) solution.beliefs.push_back(Eigen::VectorXd::Zero(unary.size()));
  std::vector<std::size_t> labels(size(), 0);
  solution.score = -std::numeric_limits<double>::infinity();
  const auto next = [&] {
    for (std::size_t i = 0; i < size(); ++i) {
      if (++labels[i] < static_cast<std::size_t>(unary_[i].size())) return true;
      labels[i] = 0;
    }
    return false;
  };
  do {
    const double total = score(labels);
    if (total > solution.score) solution.score = total, solution.labels = labels;
  } while (next());
  do {
    const double weight = std::exp(score(labels) - solution.score);
    for (std::size_t i = 0; i < size(); ++i) solution.beliefs[i](index(labels[i])) += weight;
  } while (next());
  for (Eigen::VectorXd& belief : solution.beliefs) belief /= belief.sum();
  return solution;
}

}  // namespace parhelion::semantic
