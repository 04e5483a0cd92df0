// A scan as points in base_link at the scan's stamp, corrected beam by beam for the motion during the sweep.
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
  std::vector<Eigen::Vector2d> points;  ///< m, base_link at the stamp; hits only, in the order of the beams
  std::size_t beams = 0;                ///< of the scan that the points come from, as its angles
  float angle_min = 0, angle_increment = 0;  ///< rad
};

/// `twist`: of the base during the sweep. Only hits become points; those of a rolled or tilted laser are
/// projected to the floor plane.
ScanPoints deskewed(const Scan& scan, const LaserDescription& laser, const Twist2& twist);
/// One point of it, which must be a hit.
Eigen::Vector2d deskewed_point(const Scan& scan, std::size_t beam, const LaserDescription& laser,
                               const Twist2& twist);

/// The scan that a robot at rest at the stamp would have taken: the points resampled at regular beam angles,
/// interpolated on the line between neighbours. NaN: unknown.
Scan rectified(const ScanPoints& scan, const LaserDescription& laser);

/// At most `count` points, spread evenly over the scan.
std::vector<Eigen::Vector2d> thinned(std::span<const Eigen::Vector2d> points, std::size_t count);

}  // namespace parhelion::pose
