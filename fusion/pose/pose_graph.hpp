// A graph of planar poses and what was measured between them.
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
  bool loop = false;  ///< may be wrong: weighed down where the others disagree
};

/// Least squares by damped Gauss-Newton on a sparse Cholesky factor (Grisetti et al. 2010); pose 0 stays.
/// Loop edges are weighed by Geman and McClure's function, in a few rounds, so that a wrong one does not bend
/// the rest. (MRPT 2.5.8's optimize_graph_spa_levmarq takes or refuses its steps by the error without
/// weights, so a wrong loop stays in force.)
std::vector<Pose2> optimized(const std::vector<Pose2>& poses, const std::vector<PoseGraphEdge>& edges,
                             int rounds);

}  // namespace parhelion::pose
