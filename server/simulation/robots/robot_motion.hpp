// Motion of a simulated robot: the input of its sensors.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/joints.hpp"

namespace parhelion::simulation {

/// Motion of an articulated robot at the newest step.
struct RobotMotion {
  Transform<Map, Base> T_map_base;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();       ///< m/s, map frame, of base_link's origin
  Eigen::Vector3d rotation_rate = Eigen::Vector3d::Zero();  ///< rad/s, map frame
  Eigen::Vector3d acceleration =
      Eigen::Vector3d::Zero();  ///< m/s^2, map frame, mean over the newest step, without gravity: 0 at rest
  double left = 0, right = 0;   ///< m, travel of each side's surface since its spawn, slip included
  Joints joints;                ///< all movable ones except wheels; positions, velocities, efforts
  std::vector<bool> broken;     ///< parallel to joints.names
  std::vector<std::string> touching;  ///< bumper links in contact, in the model's order
  std::uint32_t epoch = 0;            ///< counts its spawn and teleports
};

}  // namespace parhelion::simulation
