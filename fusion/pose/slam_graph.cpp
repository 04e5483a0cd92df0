#include <mrpt/graphs/CNetworkOfPoses.h>
#include <mrpt/graphslam/levmarq.h>

#include "fusion/pose/pose_graph.hpp"

namespace parhelion {
namespace {

using Graph = mrpt::graphs::CNetworkOfPoses2DInf;

mrpt::poses::CPose2D to_mrpt(const Pose2& pose) { return {pose.x, pose.y, pose.yaw}; }

double loop_weight(const PoseGraphEdge& edge, const std::vector<Pose2>& poses) {
  const Pose2 off = edge.T_from_to.inverse() * (poses[edge.from].inverse() * poses[edge.to]);
  const Eigen::Vector3d e(off.x, off.y, wrap_angle(off.yaw));
  constexpr double knee = 9;  // chi^2 at which an edge has half its say
  return 1 / (1 + e.dot(edge.information * e) / knee);
}

}  // namespace

std::vector<Pose2> optimized(const std::vector<Pose2>& poses, const std::vector<PoseGraphEdge>& edges,
                             int rounds) {
  std::vector<Pose2> result = poses;
  for (int round = 0; round < rounds; ++round) {
    Graph graph;
    graph.root = 0;
    for (std::size_t i = 0; i < result.size(); ++i) graph.nodes[i] = to_mrpt(result[i]);
    for (const PoseGraphEdge& edge : edges) {
      const double weight = edge.loop ? loop_weight(edge, result) : 1;
      mrpt::poses::CPosePDFGaussianInf measured;
      measured.mean = to_mrpt(edge.T_from_to);
      measured.cov_inv = mrpt::math::CMatrixDouble33(Eigen::Matrix3d(weight * edge.information));
      graph.insertEdgeAtEnd(edge.from, edge.to, measured);
    }
    mrpt::graphslam::TResultInfoSpaLevMarq info;
    mrpt::containers::yaml settings;
    settings["max_iterations"] = 30;
    mrpt::graphslam::optimize_graph_spa_levmarq(graph, info, nullptr, settings);
    for (std::size_t i = 0; i < result.size(); ++i) {
      const auto& node = graph.nodes.at(i);
      result[i] = {node.x(), node.y(), node.phi()};
    }
  }
  return result;
}

}  // namespace parhelion
