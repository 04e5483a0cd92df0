// Height and tilt of a recorded drive's laser, by the depth images of its log.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fusion/pose/calibration/drive_motion.hpp"
#include "protocols/robot.hpp"
#include "tools/calibration/calibration_drive.hpp"
#include "tools/calibration/laser_level.hpp"

namespace parhelion::tools {

struct FoundLevel {
  std::optional<LaserLevel> found;  ///< nullopt: see note
  std::string note;                 ///< why there is none; empty: the robot has no depth camera
};

/// Reads the depth images of the log, at most 100. `laser`: poses by scans of the part of the drive that
/// calibrates. `robot`: calibrated in all but height and tilt. `images`: on the depth camera's channel.
FoundLevel calibrate_level(const CalibrationOptions& options, const RecordedDrive& drive,
                           const RobotDescription& robot, std::size_t images,
                           const std::vector<pose::LaserPose>& laser,
                           const CalibrationProgress& progress = {});

/// Keeps the described tilt where the found one brings many hits of the part below the floor.
void keep_above_floor(const RecordedDrive& part, const RobotDescription& robot, LaserLevel& level);

}  // namespace parhelion::tools
