// SLAM for a robot that reports no odometry.
#pragma once

#include <memory>

#include "fusion/pose/slam.hpp"

namespace parhelion::pose {

/// `engine`, given odometry that is made of the scans. What `engine` finds to be wrong with odometry's motion
/// or clock is not reported: there is no odometry that somebody could mend.
std::unique_ptr<Slam> with_odometry_by_scans(const RobotDescription& robot, std::unique_ptr<Slam> engine);

}  // namespace parhelion::pose
