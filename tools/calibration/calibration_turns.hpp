// Inertial sensor and camera of a recorded drive, calibrated against the headings of its scans.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fusion/pose/calibration/turn_calibration.hpp"
#include "protocols/robot.hpp"
#include "tools/calibration/calibration_drive.hpp"

namespace parhelion::tools {

/// What was found of a sensor that notices turns.
struct TurnSensor {
  std::string name;                            ///< "IMU" or "camera"
  double before = 0;                           ///< s, its time offset in the description
  std::optional<pose::TurnCalibration> found;  ///< nullopt: see note
  std::string note;                            ///< why there is none; empty: the robot has no such sensor
  bool has_bias = false;                       ///< and a scale of its own
};

/// `laser`: poses by scans of the part of the drive that calibrates.
TurnSensor calibrate_imu(const RecordedDrive& drive, const RobotDescription& robot,
                         const std::vector<pose::LaserPose>& laser);
/// Reads the images of the log. Only those from the time of the scans are decoded.
TurnSensor calibrate_camera(const CalibrationOptions& options, const RobotDescription& robot,
                            std::size_t images, const std::vector<pose::LaserPose>& laser,
                            const CalibrationProgress& progress);
/// An independent error of its time offset, s, 1 sigma.
void add_offset_error(double sigma, TurnSensor& sensor);
/// The description with the time offsets that were shown.
RobotDescription with_time_offsets(RobotDescription robot, const TurnSensor& imu, const TurnSensor& camera);

}  // namespace parhelion::tools
