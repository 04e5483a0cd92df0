// Why a drive cannot calibrate anything.
#pragma once

#include "tools/calibration/calibration_drive.hpp"
#include "tools/calibration/calibration_log.hpp"

namespace parhelion::tools {

/// What to tell people where `error` came of the motion of `tracked`: that the robot stood, that scans fit no
/// map or show no walls, or `error` itself; with the faults that SLAM found. Times count from `first_scan`.
Error why_nothing_is_shown(const Error& error, const RecordedDrive& drive, const TrackedDrive& tracked,
                           const LaserDescription& laser, const CalibrationOptions& options,
                           SensorTime first_scan);

}  // namespace parhelion::tools
