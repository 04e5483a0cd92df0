// Whether a calibration may be used: faults of odometry and laser, and the check on the validation part.
#pragma once

#include <string>

#include "tools/calibration/calibration_drive.hpp"
#include "tools/calibration/calibration_log.hpp"

namespace parhelion::tools {

/// What SLAM found wrong in a part of the drive: refusals where it lasts for more than a tenth of the part
/// and, if it ends, 3 s; otherwise warnings. Times count from `first_scan`.
void add_faults(const TrackedDrive& part, SensorTime first_scan, CalibrationReport& report);
/// The same for the end of an error's message; empty: nothing was found.
std::string known_faults(const TrackedDrive& part, SensorTime first_scan);

/// Refuses a part of which more than a tenth of the scans that were taken in motion repeat the one before,
/// bit by bit: in a corridor SLAM does not notice that.
void add_repeated_scans(const RecordedDrive& part, CalibrationReport& report);

/// Sets the verdict, with the reasons that are not faults.
void judge(const CalibrationOptions& options, CalibrationReport& report);

}  // namespace parhelion::tools
