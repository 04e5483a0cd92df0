// A graph of 3D poses and the measurements between them; the planar one is pose_graph.hpp. Header only, so
// that fusion/cloud does not need this module's library.
#pragma once

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace parhelion::pose {

struct PoseGraph3Edge {
  std::size_t from = 0, to = 0;
  Eigen::Isometry3d T_from_to = Eigen::Isometry3d::Identity();
  /// Of translation (m) and rotation vector (rad) of the error, in the frame of `to`.
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Identity();
  bool loop = false;  ///< may be wrong: gets less weight where it contradicts the others
};

namespace pose_graph3 {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Poses = std::vector<Eigen::Isometry3d>;
using Edges = std::vector<PoseGraph3Edge>;

inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

inline Eigen::Isometry3d error_pose(const PoseGraph3Edge& edge, const Poses& poses) {
  return edge.T_from_to.inverse(Eigen::Isometry) * poses[edge.from].inverse(Eigen::Isometry) * poses[edge.to];
}

inline Vector6 residual(const Eigen::Isometry3d& error) {
  const Eigen::AngleAxisd turn(error.linear());
  Vector6 e;
  e << error.translation(), turn.angle() * turn.axis();
  return e;
}

/// Geman and McClure. `knee`: chi^2 at which the weight of an edge is a quarter.
inline double loop_weight(const PoseGraph3Edge& edge, const Poses& poses, double knee) {
  const Vector6 e = residual(error_pose(edge, poses));
  const double root_weight = knee / (knee + e.dot(edge.information * e));
  return root_weight * root_weight;
}

inline double cost(const Poses& poses, const Edges& edges, const std::vector<double>& weights) {
  double sum = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Vector6 e = residual(error_pose(edges[i], poses));
    sum += weights[i] * e.dot(edges[i].information * e);
  }
  return sum;
}

/// T after a step in its own frame.
inline Eigen::Isometry3d moved(const Eigen::Isometry3d& T, const Vector6& step) {
  const double angle = step.tail<3>().norm();
  Eigen::Isometry3d delta = Eigen::Isometry3d::Identity();
  if (angle > 0) delta.linear() = Eigen::AngleAxisd(angle, step.tail<3>() / angle).toRotationMatrix();
  delta.translation() = step.head<3>();
  Eigen::Isometry3d result = T * delta;
  result.linear() = Eigen::Quaterniond(result.linear()).normalized().toRotationMatrix();
  return result;
}

/// One damped Gauss-Newton step; pose 0 has no column. Jacobians to first order of the error.
inline Poses stepped(const Poses& poses, const Edges& edges, const std::vector<double>& weights,
                     double damping) {
  const auto n = static_cast<Eigen::Index>(6 * (poses.size() - 1));
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(edges.size() * 144);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const PoseGraph3Edge& edge = edges[k];
    const Eigen::Isometry3d error = error_pose(edge, poses);
    const Eigen::Isometry3d T_to_from = poses[edge.to].inverse(Eigen::Isometry) * poses[edge.from];
    Matrix6 J_to = Matrix6::Identity(), adjoint = Matrix6::Zero();
    J_to.topLeftCorner<3, 3>() = error.linear();
    adjoint.topLeftCorner<3, 3>() = adjoint.bottomRightCorner<3, 3>() = T_to_from.linear();
    adjoint.topRightCorner<3, 3>() = cross_matrix(T_to_from.translation()) * T_to_from.linear();
    const Matrix6 J[2] = {-J_to * adjoint, J_to};
    const Matrix6 W = weights[k] * edge.information;
    const Vector6 We = W * residual(error);
    const Eigen::Index at[2] = {6 * (static_cast<Eigen::Index>(edge.from) - 1),
                                6 * (static_cast<Eigen::Index>(edge.to) - 1)};
    for (int i = 0; i < 2; ++i) {
      if (at[i] < 0) continue;
      b.segment<6>(at[i]) += J[i].transpose() * We;
      for (int j = 0; j < 2; ++j) {
        if (at[j] < 0) continue;
        const Matrix6 block = J[i].transpose() * W * J[j];
        for (int r = 0; r < 6; ++r) {
          for (int s = 0; s < 6; ++s) entries.emplace_back(at[i] + r, at[j] + s, block(r, s));
        }
      }
    }
  }
  Eigen::SparseMatrix<double> H(n, n);
  H.setFromTriplets(entries.begin(), entries.end());
  for (Eigen::Index i = 0; i < n; ++i) H.coeffRef(i, i) += damping * H.coeff(i, i) + 1e-9;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(H);
  if (solver.info() != Eigen::Success) return poses;
  const Eigen::VectorXd step = solver.solve(-b);
  if (!step.allFinite()) return poses;
  Poses next = poses;
  for (std::size_t i = 1; i < next.size(); ++i)
    next[i] = moved(next[i], step.segment<6>(6 * (static_cast<Eigen::Index>(i) - 1)));
  return next;
}

inline Poses minimized(Poses poses, const Edges& edges, const std::vector<double>& weights) {
  constexpr int max_steps = 20;
  double damping = 1e-6, before = cost(poses, edges, weights);
  for (int i = 0; i < max_steps; ++i) {
    Poses next = stepped(poses, edges, weights, damping);
    const double after = cost(next, edges, weights);
    if (!(after <= before)) {
      damping *= 100;
      continue;
    }
    const bool done = before - after < 1e-6 * before + 1e-9;
    poses = std::move(next);
    before = after;
    damping = std::max(1e-9, damping / 10);
    if (done) break;
  }
  return poses;
}

}  // namespace pose_graph3

/// Least squares by damped Gauss-Newton on a sparse Cholesky factor (Grisetti et al. 2010); pose 0 is fixed,
/// and all others are connected to it by edges. Loop edges are weighted by Geman and McClure's kernel, which
/// starts at the width of the worst edge and narrows (graduated non-convexity, Yang et al. 2020): before a
/// long loop is closed its own edges seem wrong too, and at the end a wrong loop does not distort the others.
inline std::vector<Eigen::Isometry3d> optimize_pose_graph(const std::vector<Eigen::Isometry3d>& poses,
                                                          const std::vector<PoseGraph3Edge>& edges) {
  constexpr double last_knee = 13, narrowing = 4;  // chi^2 of 6 dof exceeds 13 in 1 of 23 cases
  std::vector<Eigen::Isometry3d> result = poses;
  if (poses.size() < 2) return result;
  double knee = last_knee;
  for (const PoseGraph3Edge& edge : edges) {
    const pose_graph3::Vector6 e = pose_graph3::residual(pose_graph3::error_pose(edge, poses));
    if (edge.loop) knee = std::max(knee, e.dot(edge.information * e));
  }
  for (bool last = false; !last; knee = std::max(last_knee, knee / narrowing)) {
    last = knee <= last_knee;
    std::vector<double> weights;
    weights.reserve(edges.size());
    for (const PoseGraph3Edge& edge : edges)
      weights.push_back(edge.loop ? pose_graph3::loop_weight(edge, result, knee) : 1);
    result = pose_graph3::minimized(std::move(result), edges, weights);
  }
  return result;
}

}  // namespace parhelion::pose
