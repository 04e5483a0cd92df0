// Parhelion's own engine of SLAM. Callers use make_mapper and make_localizer (slam.hpp), which check the
// options.
#pragma once

#include <memory>
#include <string>

#include "fusion/pose/maps/frozen_map.hpp"
#include "fusion/pose/slam.hpp"
#include "fusion/pose/tracking/scan_tracking.hpp"

namespace parhelion::pose {

/// The motion during a sweep: as the caller knows it, where odometry has no fault; otherwise as `odometry`,
/// what has arrived, and `tracking` say.
inline SweepMotion sweep_motion(const SlamOptions& options, const ScanTracking& tracking, SensorTime stamp,
                                const SweepMotion& odometry) {
  if (tracking.fault() != OdometryFault::none) return tracking.twist_at(odometry.twist);
  if (options.sweep_motion) {
    if (const auto known = options.sweep_motion(stamp)) return *known;
  }
  return odometry;
}

/// In slam_mapper.cpp.
Result<std::unique_ptr<Slam>> make_own_mapper(const RobotDescription& robot, const SlamOptions& options);
/// In slam_localizer.cpp.
Result<std::unique_ptr<Slam>> make_own_localizer(const RobotDescription& robot, const std::string& map_path,
                                                 const SlamOptions& options);
/// In a map that is loaded already.
std::unique_ptr<Slam> make_own_localizer(const RobotDescription& robot, std::shared_ptr<const FrozenMap> map,
                                         const SlamOptions& options);

}  // namespace parhelion::pose
