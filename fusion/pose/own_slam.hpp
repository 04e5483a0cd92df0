// Parhelion's own engine of SLAM. Callers use make_mapper and make_localizer (slam.hpp), which check the
// options.
#pragma once

#include <memory>
#include <string>

#include "fusion/pose/slam.hpp"

namespace parhelion::pose {

/// In slam_mapper.cpp.
Result<std::unique_ptr<Slam>> make_own_mapper(const RobotDescription& robot, const SlamOptions& options);
/// In slam_localizer.cpp.
Result<std::unique_ptr<Slam>> make_own_localizer(const RobotDescription& robot, const std::string& map_path,
                                                 const SlamOptions& options);

}  // namespace parhelion::pose
