// The robot's motion while its laser sweeps, for recordings: from odometry before and after the sweep. Live,
// a scan is corrected with the odometry that has arrived, whose twist is late and, as it must be cautious,
// small where the robot weaves: poses are then true to an instant beside the scan's stamp.
#pragma once

#include <optional>
#include <vector>

#include "fusion/pose/calibration/drive_motion.hpp"
#include "fusion/pose/calibration/motion_calibration.hpp"
#include "fusion/pose/matching/sweep_motion.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

class RecordedSweeps {
 public:
  /// `odometry`: raw, of the whole drive; `correction`: what is known of its errors. `beams`: of a scan.
  RecordedSweeps(const std::vector<Odometry>& odometry, const OdometryCorrection& correction,
                 const LaserDescription& laser, std::size_t beams);

  /// During the sweep of the scan with this stamp; nullopt outside of the odometry and in its gaps.
  std::optional<SweepMotion> at(SensorTime stamp) const;
  /// s, 1 sigma: of a time offset against scans that were corrected with these motions, beside other errors.
  /// `noise`: of a step between two scans, `step` s apart; `rate`: rad/s, RMS of the robot's turning.
  double offset_sigma(const MotionNoise& noise, double step, double rate) const;
  /// s, 1 sigma: the part of it that even exact odometry leaves.
  double left_over() const;
  double sweep() const { return sweep_.seconds(); }

 private:
  OdometryPath path_;
  OdometryCorrection correction_;
  Duration begin_, end_;  ///< relative to the stamp, of the odometry that is used
  Duration sweep_;
};

}  // namespace parhelion::pose
