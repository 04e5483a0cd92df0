// Calibration of a sensor that notices turns, an inertial sensor or a camera, against the headings of the
// scans of a drive: the time offset between their clocks, scale and bias. Least squares over windows of some
// seconds, each with a heading of its own, so that neither drift of the map nor of the sensor adds up; the
// offset is continuous, as the sensor's turns are interpolated at the instants of the scans (after Furgale,
// Rehder and Siegwart, "Unified temporal and spatial calibration for multi-sensor systems", IROS 2013, for
// one axis).
#pragma once

#include <string>
#include <vector>

#include "fusion/pose/calibration/motion_calibration.hpp"
#include "fusion/pose/calibration/turn_path.hpp"
#include "protocols/status.hpp"

namespace parhelion::pose {

struct TurnCalibration {
  Measured time_offset;  ///< s, to add to stamps of the sensor: then they are on the clock of the scans
  Measured scale;        ///< true radians per radian of the sensor
  Measured bias;         ///< rad/s, of the sensor at rest
  std::size_t poses = 0, outliers = 0;
  double turned = 0;         ///< rad, by the scans, where the sensor was on; sum of absolute values
  double heading_sigma = 0;  ///< rad, of a heading by the scans against the sensor at rest
  double jitter = 0;         ///< s, 1 sigma of their stamps against each other
  /// Messages for the user: each quantity that the drive does not determine, and a drive that would.
  std::vector<std::string> advice;
};

struct TurnStart {
  std::string sensor = "sensor";  ///< its name in texts for people
  double time_offset = 0;         ///< s, as the description has it
  /// False: a camera, whose turns have no bias, and whose scale is that of the surroundings' distance.
  bool measures_rates = true;
};

/// Offsets within 1 s of the start are found. Errors: too few scans at the sensor's instants, or turns that
/// are not those of the scans, as of a sensor that is mounted upside down; without file names.
Result<TurnCalibration> calibrate_turns(const std::vector<LaserPose>& laser, const TurnPath& sensor,
                                        const TurnStart& start);

}  // namespace parhelion::pose
