// A scan as points where the robot was at the scan's stamp: the motion during the sweep is taken out beam by
// beam.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "protocols/pose2.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"

namespace parhelion::pose {

struct ScanPoints {
  SensorTime stamp;
  Eigen::Vector2d laser = Eigen::Vector2d::Zero();  ///< m, base_link
  std::vector<Eigen::Vector2d> points;    ///< m, base_link at the stamp; hits only, in the order of the beams
  std::size_t beams = 0;                  ///< of the scan that they come from, with its angles
  float angle_first = 0, angle_step = 0;  ///< rad
};

/// `twist`: of the base during the sweep. Only hits become points; a laser that is rolled over or tilted is
/// projected to the floor plane.
ScanPoints deskewed(const Scan& scan, const LaserDescription& laser, const Twist2& twist);

/// The scan that a robot standing still at the stamp would have taken: the points laid back on regular beams,
/// between two neighbours on the line through them. NaN where nothing is known.
Scan rectified(const ScanPoints& scan, const LaserDescription& laser);

/// At most `count` points, spread evenly over the scan.
std::vector<Eigen::Vector2d> thinned(std::span<const Eigen::Vector2d> points, std::size_t count);

}  // namespace parhelion::pose
