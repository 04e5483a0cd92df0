#include "fusion/pose/mapping/pose_graph.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>

namespace parhelion::pose {
namespace {

/// Difference of the poses minus the measurement, in the frame of `from`, as for the information matrix.
Eigen::Vector3d residual(const PoseGraphEdge& edge, const std::vector<Pose2>& poses) {
  const Pose2 seen = poses[edge.from].inverse() * poses[edge.to];
  return {seen.x - edge.T_from_to.x, seen.y - edge.T_from_to.y, wrap_angle(seen.yaw - edge.T_from_to.yaw)};
}

/// Geman and McClure. `knee`: chi^2 at which the weight of an edge is a quarter.
double loop_weight(const PoseGraphEdge& edge, const std::vector<Pose2>& poses, double knee) {
  const Eigen::Vector3d e = residual(edge, poses);
  const double root_weight = knee / (knee + e.dot(edge.information * e));
  return root_weight * root_weight;
}

double weighted_cost(const std::vector<Pose2>& poses, const std::vector<PoseGraphEdge>& edges,
                     const std::vector<double>& weights) {
  double cost = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Eigen::Vector3d e = residual(edges[i], poses);
    cost += weights[i] * e.dot(edges[i].information * e);
  }
  return cost;
}

/// The places of its entries are analysed once for all steps with the same edges.
struct SparseSolver {
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> cholesky;
  bool analysed = false;
};

/// One damped Gauss-Newton step; pose 0 has no column.
std::vector<Pose2> stepped(const std::vector<Pose2>& poses, const std::vector<PoseGraphEdge>& edges,
                           const std::vector<double>& weights, double damping, SparseSolver& solver) {
  const auto n = static_cast<Eigen::Index>(3 * (poses.size() - 1));
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(edges.size() * 36);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(n);
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const PoseGraphEdge& edge = edges[k];
    const Pose2 &a = poses[edge.from], &c = poses[edge.to];
    const double cos = std::cos(a.yaw), sin = std::sin(a.yaw), dx = c.x - a.x, dy = c.y - a.y;
    Eigen::Matrix3d J[2];
    J[0] << -cos, -sin, -sin * dx + cos * dy, sin, -cos, -cos * dx - sin * dy, 0, 0, -1;
    J[1] << cos, sin, 0, -sin, cos, 0, 0, 0, 1;
    const Eigen::Matrix3d W = weights[k] * edge.information;
    const Eigen::Vector3d We = W * residual(edge, poses);
    const Eigen::Index at[2] = {3 * (static_cast<Eigen::Index>(edge.from) - 1),
                                3 * (static_cast<Eigen::Index>(edge.to) - 1)};
    for (int i = 0; i < 2; ++i) {
      if (at[i] < 0) continue;
      b.segment<3>(at[i]) += J[i].transpose() * We;
      for (int j = 0; j < 2; ++j) {
        if (at[j] < 0) continue;
        const Eigen::Matrix3d block = J[i].transpose() * W * J[j];
        for (int r = 0; r < 3; ++r) {
          for (int s = 0; s < 3; ++s) entries.emplace_back(at[i] + r, at[j] + s, block(r, s));
        }
      }
    }
  }
  for (Eigen::Index i = 0; i < n; ++i) entries.emplace_back(i, i, damping);
  Eigen::SparseMatrix<double> H(n, n);
  H.setFromTriplets(entries.begin(), entries.end());
  if (!solver.analysed) solver.cholesky.analyzePattern(H);
  solver.analysed = true;
  solver.cholesky.factorize(H);
  if (solver.cholesky.info() != Eigen::Success) return poses;
  const Eigen::VectorXd step = solver.cholesky.solve(-b);
  std::vector<Pose2> next = poses;
  for (std::size_t i = 1; i < next.size(); ++i) {
    const Eigen::Vector3d d = step.segment<3>(3 * (static_cast<Eigen::Index>(i) - 1));
    next[i] = {next[i].x + d.x(), next[i].y + d.y(), wrap_angle(next[i].yaw + d.z())};
  }
  return next;
}

}  // namespace

struct PoseGraphOptimization::Solver : SparseSolver {};

PoseGraphOptimization::PoseGraphOptimization(std::vector<Pose2> poses, std::vector<PoseGraphEdge> edges,
                                             int iterations)
    : poses_(std::move(poses)),
      edges_(std::move(edges)),
      solver_(std::make_unique<Solver>()),
      iterations_(poses_.size() < 2 ? 0 : iterations) {}
PoseGraphOptimization::PoseGraphOptimization(PoseGraphOptimization&&) noexcept = default;
PoseGraphOptimization& PoseGraphOptimization::operator=(PoseGraphOptimization&&) noexcept = default;
PoseGraphOptimization::~PoseGraphOptimization() = default;

/// Wide at first: before a long loop is closed its own edges seem wrong too (graduated non-convexity, Yang et
/// al. 2020).
void PoseGraphOptimization::begin_iteration() {
  const double knee =
      9 * std::pow(100.0, iterations_ > 1 ? 1 - static_cast<double>(iteration_) / (iterations_ - 1) : 0);
  weights_.clear();
  for (const PoseGraphEdge& edge : edges_)
    weights_.push_back(edge.loop ? loop_weight(edge, poses_, knee) : 1);
  damping_ = 1e-3;
  cost_ = weighted_cost(poses_, edges_, weights_);
}

bool PoseGraphOptimization::step() {
  constexpr int max_steps = 20;
  if (iteration_ >= iterations_) return true;
  if (steps_ == 0) begin_iteration();
  std::vector<Pose2> next = stepped(poses_, edges_, weights_, damping_, *solver_);
  const double next_cost = weighted_cost(next, edges_, weights_);
  bool done = ++steps_ == max_steps;
  if (next_cost > cost_) {
    damping_ *= 100;
  } else {
    done = done || cost_ - next_cost < 1e-5 * cost_ + 1e-9;
    poses_ = std::move(next);
    cost_ = next_cost;
    damping_ = std::max(1e-6, damping_ / 10);
  }
  if (done) ++iteration_, steps_ = 0;
  return iteration_ == iterations_;
}

std::vector<Pose2> optimize_pose_graph(const std::vector<Pose2>& poses,
                                       const std::vector<PoseGraphEdge>& edges, int iterations) {
  PoseGraphOptimization optimization(poses, edges, iterations);
  while (!optimization.step()) {
  }
  return optimization.poses();
}

std::vector<double> shortest_paths(const std::vector<PoseGraphEdge>& edges, std::size_t poses,
                                   std::size_t from) {
  struct Path {
    double length;
    std::size_t to;
    bool operator>(const Path& other) const { return length > other.length; }
  };
  std::vector<std::vector<Path>> neighbours(poses);
  for (const PoseGraphEdge& edge : edges) {
    const double length = edge.T_from_to.position().norm();
    neighbours[edge.from].push_back({length, edge.to});
    neighbours[edge.to].push_back({length, edge.from});
  }
  std::vector<double> shortest(poses, std::numeric_limits<double>::infinity());
  std::priority_queue<Path, std::vector<Path>, std::greater<>> open;
  shortest[from] = 0;
  open.push({0, from});
  while (!open.empty()) {
    const Path nearest = open.top();
    open.pop();
    if (nearest.length > shortest[nearest.to]) continue;
    for (const Path& next : neighbours[nearest.to]) {
      const double length = nearest.length + next.length;
      if (length >= shortest[next.to]) continue;
      shortest[next.to] = length;
      open.push({length, next.to});
    }
  }
  return shortest;
}

}  // namespace parhelion::pose
