// Joint labelling: loopy messages and local search against exhaustive enumeration.
#include "fusion/semantic/net/factor_graph.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace parhelion::semantic {
namespace {

/// `n` variables with three labels each; a tree, with `extra` more pairs.
FactorGraph random_graph(std::mt19937& random, std::size_t n, int extra, double strength) {
  const auto uniform = [&] { return random() / 4294967296.0; };
  FactorGraph graph;
  for (std::size_t i = 0; i < n; ++i) {
    Eigen::VectorXd scores(3);
    for (double& s : scores) s = 3 * uniform();
    graph.add_variable(scores);
  }
  const auto connect = [&](std::size_t a, std::size_t b) {
    Eigen::MatrixXd scores(3, 3);
    for (int k = 0; k < 9; ++k) scores(k / 3, k % 3) = strength * (2 * uniform() - 1);
    graph.add_pair(a, b, scores);
  };
  for (std::size_t i = 1; i < n; ++i) connect(random() % i, i);
  for (int k = 0; k < extra; ++k) {
    const std::size_t a = random() % n, b = random() % n;
    if (a != b) connect(a, b);
  }
  return graph;
}

TEST(FactorGraph, BeliefsAndLabelsAreExactOnTrees) {
  std::mt19937 random(1);
  int same = 0;
  for (int k = 0; k < 200; ++k) {
    const FactorGraph graph = random_graph(random, 2 + random() % 6, 0, 3);
    const auto fast = graph.solve(), exact = graph.enumerate();
    EXPECT_LE(fast.score, exact.score + 1e-9);
    EXPECT_NEAR(fast.score, graph.score(fast.labels), 1e-9);
    same += fast.labels == exact.labels ? 1 : 0;
    for (std::size_t i = 0; i < graph.size(); ++i) {
      EXPECT_NEAR(fast.beliefs[i].sum(), 1, 1e-9);
      EXPECT_LT((fast.beliefs[i] - exact.beliefs[i]).cwiseAbs().maxCoeff(), 1e-6) << "graph " << k;
    }
  }
  EXPECT_GE(same, 190) << "of 200";
}

TEST(FactorGraph, FindsTheBestAssignmentOfMostSmallLoops) {
  std::mt19937 random(2);
  int same = 0;
  for (int k = 0; k < 200; ++k) {
    const FactorGraph graph = random_graph(random, 7, 4, 1.5);
    const auto fast = graph.solve(), exact = graph.enumerate();
    EXPECT_LE(fast.score, exact.score + 1e-9);
    same += exact.score - fast.score < 1e-9 ? 1 : 0;
  }
  // Random signs cause frustration, unlike the relations of a building: 183 when this was written.
  EXPECT_GE(same, 175) << "of 200";
}

TEST(FactorGraph, IsDeterministic) {
  std::mt19937 random(3);
  const FactorGraph graph = random_graph(random, 40, 60, 2);
  const auto one = graph.solve(), two = graph.solve();
  EXPECT_EQ(one.labels, two.labels);
  for (std::size_t i = 0; i < graph.size(); ++i) EXPECT_EQ(one.beliefs[i], two.beliefs[i]);
}

TEST(FactorGraph, FindsLabelsThatAreBestOnlyJointly) {
  // Four that only win together, against one each for the other label: no change of one or of a pair is
  // better.
  const auto chain = [](bool proposed) {
    FactorGraph graph;
    for (int i = 0; i < 4; ++i) graph.add_variable(Eigen::Vector2d(2, 0));
    for (std::size_t i = 0; i < 3; ++i)
      graph.add_pair(i, i + 1, (Eigen::Matrix2d() << 0, -3, -3, 2.8).finished());
    if (proposed) graph.propose({{0, 1}, {1, 1}, {2, 1}, {3, 1}});
    return graph;
  };
  const auto best = chain(true).enumerate();
  EXPECT_EQ(best.labels, std::vector<std::size_t>(4, 1));
  EXPECT_EQ(chain(true).solve().labels, best.labels);
  EXPECT_GE(chain(true).solve().score, chain(false).solve().score);
}

}  // namespace
}  // namespace parhelion::semantic
