// The frames of a bag's /tf and /tf_static: mounting poses of the robot's parts.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/import/ros_message.hpp"

namespace parhelion::tools {

class RosFrames {
 public:
  struct Edge {
    /// Of the child in its parent: as first published, or, if it is static, as last published.
    Eigen::Isometry3d first;
    std::uint64_t count = 0;
    bool moves = false;         ///< by more than 1 mm or 0.1 degrees
    bool contradicted = false;  ///< static, but published with poses that differ as much
  };
  using Key = std::pair<std::string, std::string>;  ///< parent, child

  /// `is_static`: from /tf_static, where tf uses what was published last.
  void add(const ros::StampedTransform& transform, bool is_static = false);

  /// Pose of `to` in `from` along the edges' first poses; nullopt: not connected. `moves` is set if an
  /// edge moves.
  std::optional<Eigen::Isometry3d> find(const std::string& from, const std::string& to, bool& moves) const;
  bool has(const std::string& frame) const;
  /// Edges from an odometry frame ("odom", ".../odom", "odom_combined") to one that is not a map.
  std::vector<Key> odometry_edges() const;
  const std::map<Key, Edge>& edges() const { return edges_; }
  /// Static edges above `frame` that were published with different poses, as notes for people.
  std::vector<std::string> contradictions(std::string frame) const;
  /// All static edges as text for the robot description.
  std::string static_edges_text() const;

 private:
  std::map<Key, Edge> edges_;
};

}  // namespace parhelion::tools
