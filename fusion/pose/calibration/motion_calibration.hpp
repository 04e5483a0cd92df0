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
#include "protocols/time.hpp"

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

/// The values in a description.
MotionParameters motion_parameters(const RobotDescription& robot);
/// The description with odometry and laser mounting (x, y, yaw; height and tilt stay) replaced.
RobotDescription with_motion_parameters(RobotDescription robot, const MotionParameters& parameters);

/// The description for the SLAM run that a calibration starts from, with more weight on scans. Otherwise the
/// laser's poses would be biased towards the odometry and the mounting that are to be checked.
RobotDescription with_weak_odometry(RobotDescription robot);

/// A quantity with its confidence.
struct Measured {
  double value = 0,
         sigma = 0;  ///< 1 sigma, the larger of the fit's own and of leaving out tenths of the drive
  /// False: the drive does not determine it. The value is then the described one, and sigma the uncertainty
  /// assumed for described values.
  bool shown = false;
};

struct MotionNoise {
  double laser_position = 0.01, laser_yaw = 0.005;          ///< m, rad: of one pose of the laser
  double along = 0.01, across = 0.01, turn = 0.005;         ///< m, m, rad: odometry between two poses
  double reference_position = 0.01, reference_yaw = 0.005;  ///< m, rad

  /// Difference between a step of odometry and one of the laser, m^2 rad^2, to compare methods that estimate
  /// the laser's poses of one drive.
  double misfit() const {
    return (along * along + across * across + 4 * laser_position * laser_position) *
           (turn * turn + 2 * laser_yaw * laser_yaw);
  }
};

struct MotionCalibration {
  MotionParameters parameters;
  std::array<Measured, kMotionParameters> measured;
  /// s, 1 sigma of the time offset about its mean. Interpolated odometry shows only about four fifths of a
  /// jitter of odometry's own stamps.
  Measured jitter;
  MotionNoise noise;
  std::size_t poses = 0, steps = 0, outliers = 0;  ///< outliers: steps of odometry, as of slipping wheels
  std::size_t references = 0;
  std::size_t left_out = 0;          ///< samples of odometry not later than one before
  double driven = 0, turned = 0;     ///< m, rad, sums of absolute values
  double forward = 0, backward = 0;  ///< m, by odometry as it was received
  /// Messages for the user: each quantity that the drive does not determine, and a drive that would.
  std::vector<std::string> advice;

  const Measured& operator[](MotionParameter parameter) const {
    return measured[static_cast<std::size_t>(parameter)];
  }
  /// An independent error of the offset between the clocks of odometry and scans, s, 1 sigma.
  void add_offset_error(double sigma);
  /// The same of the jitter of their stamps.
  void add_jitter_error(double sigma);
  /// With wheels of two sizes a robot turns about a point beside their middle, by a quarter of the track
  /// width times their difference: from there laser y counts, as a drive does not show that the wheels are
  /// `width` (m) apart.
  void add_turning_point_error(double width);
};

/// Error: too few poses, no odometry at their instants, or a drive that hardly moves; without file names.
Result<MotionCalibration> calibrate_motion(const DriveMotion& drive, const MotionParameters& start);

/// Odometry against the laser over one window of a drive.
struct WindowError {
  SensorTime begin;              ///< stamp of its first scan
  double position = 0, yaw = 0;  ///< m, rad: by how much both differ at its end
  double moved = 0, turned = 0;  ///< m, rad: from its begin to its end, by the one that moved more
};

/// Odometry against the laser over windows of a drive: how well a calibration holds there.
struct MotionCheck {
  std::size_t windows = 0;
  double position_rms = 0, position_p95 = 0;  ///< m
  double yaw_rms = 0, yaw_p95 = 0;            ///< rad
  double moved_rms = 0, turned_rms = 0;       ///< m, rad: the motion in a window
  std::vector<WindowError> errors;            ///< in the order of their begins; windows overlap

  /// m: the error of position, and that of yaw as a distance at `kArm`, in one.
  double combined_rms() const;
  /// The same without the worst 15 % of the windows, so that a single slip does not decide.
  double combined_rms_but_worst() const;
  static constexpr double kArm = 0.3;  ///< m
};
MotionCheck check_motion(const DriveMotion& drive, const MotionParameters& parameters, double window_seconds);

enum class MotionChange : std::uint8_t { better, as_good, worse };
/// Compares two calibrations on the same drive, by the mean square of the combined error over the windows
/// that both have. The margin for chance comes from the scatter between blocks of time. A calibration is
/// worse only if its error is larger by a fifth, too.
MotionChange change_between(const MotionCheck& before, const MotionCheck& after);

/// Why odometry with this calibration cannot be the robot's motion, with figures; empty: no objection.
/// `fitted`: the same on the part that it was fitted to.
std::string unexplained_error(const MotionCheck& fitted, const MotionCheck& after);

/// Dead reckoning with corrected odometry from the first pose of the laser: base poses in the laser's map,
/// one for each pose of the laser; and the same poses according to the laser.
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
