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

TEST(PoseGraphOptimization, GivesTheSameStepByStep) {
  std::vector<Pose2> poses(10);
  for (std::size_t i = 1; i < poses.size(); ++i) poses[i] = poses[i - 1] * Pose2{1, 0, 0.55};
  const std::vector<PoseGraphEdge> edges = poses_and_a_loop();
  PoseGraphOptimization optimization(poses, edges, 2);
  int steps = 1;
  for (; !optimization.step(); ++steps) ASSERT_LT(steps, 2 * 20);
  EXPECT_GT(steps, 2) << "a step does a part of the work";
  const std::vector<Pose2> at_once = optimize_pose_graph(poses, edges, 2);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(optimization.poses()[i].x, at_once[i].x);
    EXPECT_EQ(optimization.poses()[i].yaw, at_once[i].yaw);
  }
  EXPECT_TRUE(optimization.step()) << "nothing is left";
}

TEST(PoseGraphOptimization, OfOnePoseHasNothingToDo) {
  EXPECT_TRUE(PoseGraphOptimization({{1, 2, 3}}, {}, 2).step());
}

}  // namespace
}  // namespace parhelion::pose
