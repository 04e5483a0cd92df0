// Somebody or something real that moves, or has moved.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "protocols/time.hpp"

namespace parhelion::people {

/// A robot is one whose pose the caller knows (KnownRobot); any mover that is not a person is `other`.
enum class MoverClass : std::uint8_t { person, robot, other };

const char* to_string(MoverClass kind);

struct Mover {
  std::uint32_t id = 0;  ///< kept while it is tracked; given again only to a person who was lost
  MoverClass kind = MoverClass::other;
  double person = 0;                                     ///< probability that it is a person, 0..1
  Eigen::Vector2d position = Eigen::Vector2d::Zero();    ///< m, map, at `stamp`; of a person between the legs
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();    ///< m/s, map
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< of x, y, vx, vy; m and s
  double radius = 0;                                     ///< m, of a disc around what was seen of it
  SimulationTime stamp;                                  ///< instant of the estimate
  SimulationTime seen;                                   ///< instant of the last scan with returns from it
};

}  // namespace parhelion::people
