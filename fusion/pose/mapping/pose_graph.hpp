// A graph of planar poses and the measurements between them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
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

/// The same in parts; its result does not depend on them.
class PoseGraphOptimization {
 public:
  PoseGraphOptimization(std::vector<Pose2> poses, std::vector<PoseGraphEdge> edges, int iterations);
  PoseGraphOptimization(PoseGraphOptimization&&) noexcept;
  PoseGraphOptimization& operator=(PoseGraphOptimization&&) noexcept;
  ~PoseGraphOptimization();

  /// One Gauss-Newton step, whose work grows with the edges. True: there is none left.
  bool step();
  const std::vector<Pose2>& poses() const { return poses_; }
  std::size_t edges() const { return edges_.size(); }

 private:
  struct Solver;
  void begin_iteration();

  std::vector<Pose2> poses_;
  std::vector<PoseGraphEdge> edges_;
  std::unique_ptr<Solver> solver_;
  int iterations_, iteration_ = 0;
  int steps_ = 0;                ///< of this iteration
  std::vector<double> weights_;  ///< of the edges in this iteration
  double damping_ = 0, cost_ = 0;
};

/// m, along edges, from one pose to each of the `poses`; infinite where no edge leads.
std::vector<double> shortest_paths(const std::vector<PoseGraphEdge>& edges, std::size_t poses,
                                   std::size_t from);

}  // namespace parhelion::pose
