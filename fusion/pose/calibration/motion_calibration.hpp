// Calibration of odometry, laser mounting and time offset from one drive, all at once: after Censi, Franchi,
// Marchionni and Oriolo, "Simultaneous calibration of odometry and sensor parameters for mobile robots", IEEE
// T-RO 29(2), 2013, as maximum likelihood over the poses of the drive (here the scans are matched to one map,
// so their errors do not accumulate), with a time offset, robust weights against slip, and noise that
// is estimated along.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "fusion/pose/calibration/drive_motion.hpp"
#include "protocols/robot.hpp"
#include "protocols/status.hpp"

namespace parhelion::pose {

enum class MotionParameter : std::uint8_t {
  translation_scale,
  rotation_scale,
  curvature,         ///< rad/m
  laser_x,           ///< m, base_link
  laser_y,           ///< m
  laser_yaw,         ///< rad
  time_offset,       ///< s, to add to stamps of odometry
  reference_x,       ///< m, of the laser's map in the frame of the reference
  reference_y,       ///< m
  reference_yaw,     ///< rad
  reference_offset,  ///< s, to add to stamps of the reference; its latency is the negative of it
};
inline constexpr std::size_t kMotionParameters = 11;
const char* to_string(MotionParameter parameter);

struct MotionParameters {
  OdometryCorrection odometry;
  Pose2 T_base_laser;
  Pose2 T_reference_map;
  double reference_offset = 0;  ///< s

  double& operator[](MotionParameter parameter);
  double operator[](MotionParameter parameter) const;
};

/// What a description says now.
MotionParameters motion_parameters(const RobotDescription& robot);
/// The description with odometry and laser mounting (x, y, yaw; height and tilt stay) replaced.
RobotDescription with_motion_parameters(RobotDescription robot, const MotionParameters& parameters);

/// The description for the SLAM that a calibration starts from: scans count for more. Otherwise the laser's
/// poses lean towards the odometry and the mounting that are to be checked.
RobotDescription with_weak_odometry(RobotDescription robot);

/// A quantity with its confidence.
struct Measured {
  double value = 0,
         sigma = 0;    ///< 1 sigma, the larger of the fit's own and of leaving out tenths of the drive
  bool shown = false;  ///< false: the drive does not show it; the value is the one from before
};

struct MotionNoise {
  double laser_position = 0.01, laser_yaw = 0.005;          ///< m, rad: of one pose of the laser
  double along = 0.01, across = 0.01, turn = 0.005;         ///< m, m, rad: odometry between two poses
  double reference_position = 0.01, reference_yaw = 0.005;  ///< m, rad

  /// By how much a step of odometry and one of the laser differ, m^2 rad^2: to compare ways to make poses of
  /// the laser of one drive.
  double misfit() const {
    return (along * along + across * across + 4 * laser_position * laser_position) *
           (turn * turn + 2 * laser_yaw * laser_yaw);
  }
};

struct MotionCalibration {
  MotionParameters parameters;
  std::array<Measured, kMotionParameters> measured;
  Measured jitter;  ///< s, 1 sigma of the time offset about its constant part
  MotionNoise noise;
  std::size_t poses = 0, steps = 0, outliers = 0;  ///< outliers: steps of odometry, as of slipping wheels
  std::size_t references = 0;
  double driven = 0, turned = 0;  ///< m, rad, sums of absolute values
  /// For people: per quantity that was not shown, and the drive that would show it.
  std::vector<std::string> advice;

  const Measured& operator[](MotionParameter parameter) const {
    return measured[static_cast<std::size_t>(parameter)];
  }
  /// An independent error of the offset between the clocks of odometry and scans, s, 1 sigma.
  void add_offset_error(double sigma);
};

/// Error: too few poses, no odometry at their instants, or a drive that hardly moves; without file names.
Result<MotionCalibration> calibrate_motion(const DriveMotion& drive, const MotionParameters& start);

/// Odometry against the laser over windows of a drive: how well a calibration holds there.
struct MotionCheck {
  std::size_t windows = 0;
  double position_rms = 0, position_p95 = 0;  ///< m
  double yaw_rms = 0, yaw_p95 = 0;            ///< rad
};
MotionCheck check_motion(const DriveMotion& drive, const MotionParameters& parameters, double window_seconds);

/// Dead reckoning by corrected odometry from the first pose of the laser on: base poses in the laser's map,
/// one a pose of the laser; and the same by the laser.
struct ReckonedPath {
  std::vector<Pose2> by_odometry, by_laser;
};
ReckonedPath reckoned_path(const DriveMotion& drive, const MotionParameters& parameters);

/// Left and right wheel and track width of a two-wheeled robot whose odometry assumed `track_width` (m):
/// factors to its wheel radii, and the true track width, m.
struct WheelModel {
  Measured left_scale, right_scale, track_width;
};
WheelModel wheel_model(const MotionCalibration& calibration, double track_width);

}  // namespace parhelion::pose
