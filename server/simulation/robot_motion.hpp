// How a simulated robot moves: what its sensors are computed from.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/joints.hpp"

namespace parhelion::simulation {

/// Of an articulated robot at the newest step.
struct RobotMotion {
  Transform<Map, Base> T_map_base;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();       ///< m/s, map frame, of base_link's origin
  Eigen::Vector3d rotation_rate = Eigen::Vector3d::Zero();  ///< rad/s, map frame
  Eigen::Vector3d acceleration =
      Eigen::Vector3d::Zero();        ///< m/s^2, map frame, over the newest step, without gravity: at rest 0
  double left = 0, right = 0;         ///< m that each side's surface has rolled since its spawn: slip shows
  Joints joints;                      ///< all that can move but wheels; positions, velocities, efforts
  std::vector<bool> broken;           ///< as joints.names
  std::vector<std::string> touching;  ///< bumper links that touch something, in the model's order
  std::uint32_t epoch = 0;            ///< counts its spawn and moves
};

}  // namespace parhelion::simulation
