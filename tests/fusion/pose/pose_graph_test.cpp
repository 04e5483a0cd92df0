#include "fusion/pose/mapping/pose_graph.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace parhelion::pose {
namespace {

/// Ten poses, each 1 m from the one before, and a loop from the last to the first.
std::vector<PoseGraphEdge> poses_and_a_loop() {
  std::vector<PoseGraphEdge> edges;
  for (std::size_t i = 0; i < 9; ++i)
    edges.push_back({i, i + 1, {1, 0, 0.6}, Eigen::Matrix3d::Identity(), false});
  edges.push_back({0, 9, {0, 0.5, 0}, Eigen::Matrix3d::Identity(), true});
  return edges;
}

TEST(ShortestPaths, GoAcrossLoops) {
  const std::vector<double> length = shortest_paths(poses_and_a_loop(), 10, 1);
  EXPECT_DOUBLE_EQ(length[1], 0);
  EXPECT_DOUBLE_EQ(length[0], 1);
  EXPECT_DOUBLE_EQ(length[5], 4);
  EXPECT_DOUBLE_EQ(length[9], 1.5);
  EXPECT_DOUBLE_EQ(length[7], 3.5);
}

TEST(ShortestPaths, AreInfiniteWhereNoEdgeLeads) {
  const std::vector<double> length = shortest_paths(poses_and_a_loop(), 11, 0);
  EXPECT_TRUE(std::isinf(length[10]));
}

}  // namespace
}  // namespace parhelion::pose
