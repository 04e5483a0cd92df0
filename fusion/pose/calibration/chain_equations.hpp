// Normal equations of a chain of planar poses and a few parameters that all of them share: block tridiagonal,
// with a border (Triggs et al., "Bundle adjustment: a modern synthesis", 1999, section 6.1).
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

namespace parhelion::pose {

template <int P>
class ChainEquations {
 public:
  using Vector = Eigen::Matrix<double, P, 1>;
  using Matrix = Eigen::Matrix<double, P, P>;
  using Border = Eigen::Matrix<double, 3, P>;

  /// One whitened residual of three components and its derivatives by pose `i`, pose i + 1, and parameters.
  struct Term {
    Eigen::Vector3d residual = Eigen::Vector3d::Zero();
    Eigen::Matrix3d J_pose = Eigen::Matrix3d::Zero(), J_next = Eigen::Matrix3d::Zero();
    Border J_parameters = Border::Zero();
  };
  struct Solution {
    std::vector<Eigen::Vector3d> poses;  ///< increments of the poses
    Vector parameters;                   ///< increment
    Matrix information;                  ///< of all parameters, fixed ones too, all poses marginalised
  };

  explicit ChainEquations(std::size_t poses) : nodes_(poses) {
    // Keeps a pose that nothing measures where it is.
    for (Node& node : nodes_) node.diagonal = 1e-6 * Eigen::Matrix3d::Identity();
  }

  void add(std::size_t i, const Term& term, double weight, bool has_next) {
    Node& node = nodes_[i];
    node.diagonal += weight * term.J_pose.transpose() * term.J_pose;
    node.border += weight * term.J_pose.transpose() * term.J_parameters;
    node.gradient += weight * term.J_pose.transpose() * term.residual;
    information_ += weight * term.J_parameters.transpose() * term.J_parameters;
    gradient_ += weight * term.J_parameters.transpose() * term.residual;
    if (!has_next) return;
    Node& next = nodes_[i + 1];
    node.to_next += weight * term.J_pose.transpose() * term.J_next;
    next.diagonal += weight * term.J_next.transpose() * term.J_next;
    next.border += weight * term.J_next.transpose() * term.J_parameters;
    next.gradient += weight * term.J_next.transpose() * term.residual;
  }

  /// A residual of one parameter, whitened by `sigma`.
  void add_prior(int parameter, double residual, double sigma) {
    information_(parameter, parameter) += 1 / (sigma * sigma);
    gradient_(parameter) += residual / (sigma * sigma);
  }

  /// Keeps the parameter at its value.
  void fix(int parameter) { fixed_[static_cast<std::size_t>(parameter)] = true; }

  /// nullopt where the equations are singular or not finite. Call once.
  std::optional<Solution> solve() {
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      Node& node = nodes_[i];
      const auto factor = node.diagonal.ldlt();
      node.solved_border = factor.solve(node.border);
      node.solved_gradient = factor.solve(node.gradient);
      node.solved_next = factor.solve(node.to_next);
      information_ -= node.border.transpose() * node.solved_border;
      gradient_ -= node.border.transpose() * node.solved_gradient;
      if (i + 1 == nodes_.size()) break;
      Node& next = nodes_[i + 1];
      next.diagonal -= node.to_next.transpose() * node.solved_next;
      next.border -= node.to_next.transpose() * node.solved_border;
      next.gradient -= node.to_next.transpose() * node.solved_gradient;
    }
    Solution solution{std::vector<Eigen::Vector3d>(nodes_.size()), parameter_step(), information_};
    Eigen::Vector3d next = Eigen::Vector3d::Zero();
    for (std::size_t i = nodes_.size(); i-- > 0;) {
      const Node& node = nodes_[i];
      next = -node.solved_gradient - node.solved_border * solution.parameters - node.solved_next * next;
      solution.poses[i] = next;
      if (!next.allFinite()) return std::nullopt;
    }
    if (!solution.parameters.allFinite()) return std::nullopt;
    return solution;
  }

 private:
  struct Node {
    Eigen::Matrix3d diagonal = Eigen::Matrix3d::Zero(), to_next = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d solved_next = Eigen::Matrix3d::Zero();
    Border border = Border::Zero(), solved_border = Border::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero(), solved_gradient = Eigen::Vector3d::Zero();
  };

  Vector parameter_step() const {
    Matrix matrix = information_;
    Vector gradient = gradient_;
    for (int k = 0; k < P; ++k) {
      if (!fixed_[static_cast<std::size_t>(k)]) continue;
      matrix.row(k).setZero();
      matrix.col(k).setZero();
      matrix(k, k) = 1;
      gradient(k) = 0;
    }
    return matrix.ldlt().solve(-gradient);
  }

  std::vector<Node> nodes_;
  Matrix information_ = Matrix::Zero();
  Vector gradient_ = Vector::Zero();
  std::array<bool, P> fixed_{};
};

}  // namespace parhelion::pose
