// From a robot model to what the physics steps and what sensors see: links that do not move against each
// other are one part; wheels and steering knuckles are shapes of their part that turn by themselves.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "server/simulation/physics.hpp"
#include "server/simulation/robot_model.hpp"

namespace parhelion::simulation {

/// Links that are seen as one body: those that are fixed to each other.
struct RobotNode {
  std::size_t link = 0;  ///< that it is named after
  std::size_t part = 0;
  std::optional<std::size_t> parent;  ///< node that it turns on; none: it is the part's own
  Eigen::Isometry3d T_parent_node = Eigen::Isometry3d::Identity();  ///< at position 0
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();                  ///< it turns about
  std::optional<std::size_t> runner;                                ///< a wheel: turned by what it rolled
  std::optional<std::size_t> steering;                              ///< a knuckle: joint that turns it
  std::vector<Shape> visible;
};

/// Where a link's collision shape is.
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
  std::vector<Joint> joints;          ///< that the physics holds, parents before children
  std::vector<std::size_t> steering;  ///< joints of the model that turn wheels

  struct Runner {
    std::size_t part = 0, index = 0;  ///< runner of that part
    std::size_t node = 0;             ///< whose frame its axis is in
    Eigen::Vector3d axis;             ///< in the node's frame
    Eigen::Vector3d center;           ///< m, base_link, joints at 0
  };
  std::vector<Runner> runners;  ///< as the model's

  /// 1/m: the tightest turns that all steering joints reach (Ackermann), to the right and to the left.
  double least_curvature = 0, most_curvature = 0;
};

RobotLayout make_layout(const RobotModel& model);

/// The turn of a frame about an axis of its own.
inline Eigen::Isometry3d turn_about(const Eigen::Vector3d& axis, double angle) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(angle, axis));
}

}  // namespace parhelion::simulation
