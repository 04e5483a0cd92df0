// Converts a robot model to physics parts and visible nodes: links without relative motion form one part;
// wheels and steering knuckles are shapes of their part that turn separately.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "server/simulation/physics/physics.hpp"
#include "server/simulation/robots/robot_model.hpp"

namespace parhelion::simulation {

/// Links seen as one body, because they are fixed to each other.
struct RobotNode {
  std::size_t link = 0;  ///< source of its name
  std::size_t part = 0;
  std::optional<std::size_t> parent;  ///< node it turns on; none: it is the part's own
  Eigen::Isometry3d T_parent_node = Eigen::Isometry3d::Identity();  ///< at position 0
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();                  ///< axis of its rotation
  std::optional<std::size_t> runner;                                ///< of a wheel, turned by its travel
  std::optional<std::size_t> steering;                              ///< of a knuckle: the joint that turns it
  std::vector<Shape> visible;
};

/// Source of a link's collision shape.
struct RobotSolid {
  std::size_t link = 0;
  std::size_t node = 0;
  Eigen::Isometry3d T_node_shape = Eigen::Isometry3d::Identity();
};

struct RobotLayout {
  std::vector<PartDefinition> parts;  ///< the first is base_link's; a part's frame is its first link's
  std::vector<RobotNode> nodes;       ///< in the order of links; the first is base_link's
  std::vector<std::vector<RobotSolid>> solids;  ///< by part and shape
  std::vector<std::size_t> node_of_link;
  std::vector<Eigen::Isometry3d> T_node_link;

  struct Joint {
    std::size_t joint = 0;  ///< of the model
    std::size_t a = 0, b = 0;
    JointDefinition definition;  ///< without handles
  };
  std::vector<Joint> joints;          ///< joints in the physics, parents before children
  std::vector<std::size_t> steering;  ///< joints of the model that steer wheels

  struct Runner {
    std::size_t part = 0, index = 0;  ///< runner of that part
    std::size_t node = 0;             ///< frame of its axis
    Eigen::Vector3d axis;             ///< in the node's frame
    Eigen::Vector3d center;           ///< m, base_link, joints at 0
  };
  std::vector<Runner> runners;  ///< in the model's order

  /// 1/m: the tightest turns possible with all steering joints (Ackermann), to the right and to the left.
  double min_curvature = 0, max_curvature = 0;
};

RobotLayout make_layout(const RobotModel& model);

/// Rotation of a frame about one of its axes.
inline Eigen::Isometry3d turn_about(const Eigen::Vector3d& axis, double angle) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(angle, axis));
}

}  // namespace parhelion::simulation
