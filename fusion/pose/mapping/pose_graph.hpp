// A graph of planar poses and the measurements between them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "protocols/pose2.hpp"

namespace parhelion::pose {

struct PoseGraphEdge {
  std::size_t from = 0, to = 0;
  Pose2 T_from_to;
  Eigen::Matrix3d information = Eigen::Matrix3d::Identity();  ///< of x, y, yaw in the frame of `from`
  bool loop = false;  ///< may be wrong: gets less weight where it contradicts the others
};

/// Least squares by damped Gauss-Newton on a sparse Cholesky factor (Grisetti et al. 2010); pose 0 is fixed.
/// Loop edges are weighted by Geman and McClure's kernel over a few iterations, so that a wrong loop does not
/// distort the others. (MRPT 2.5.8's optimize_graph_spa_levmarq accepts or rejects its steps by the
/// unweighted error, so a wrong loop keeps its influence.)
std::vector<Pose2> optimize_pose_graph(const std::vector<Pose2>& poses,
                                       const std::vector<PoseGraphEdge>& edges, int iterations);

/// m, along edges, from one pose to each of the `poses`; infinite where no edge leads.
std::vector<double> shortest_paths(const std::vector<PoseGraphEdge>& edges, std::size_t poses,
                                   std::size_t from);

}  // namespace parhelion::pose
