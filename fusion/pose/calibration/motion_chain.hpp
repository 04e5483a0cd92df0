// The poses of a drive with all that was measured of them, and the fit of parameters to it. Internal to
// motion_calibration*.cpp.
#pragma once

#include <optional>
#include <vector>

#include "fusion/pose/calibration/motion_calibration.hpp"

namespace parhelion::pose {

struct ReferenceSample {
  std::size_t node = 0;  ///< pose of the chain before it
  SensorTime stamp;
  Pose2 T_reference_base;
};

struct MotionChain {
  std::vector<LaserPose> laser;  ///< stamps increase; of a standstill one pose of many
  std::vector<ReferenceSample> reference;
  OdometryPath odometry{{}};

  /// Odometry, as received, from pose i to i + 1 by the time offset of `parameters`; nullopt where it is
  /// unknown.
  std::optional<Pose2> raw_step(std::size_t i, const MotionParameters& parameters) const;
  /// The same, corrected.
  std::optional<Pose2> step(std::size_t i, const MotionParameters& parameters) const;
  /// The same step by the laser.
  Pose2 laser_step(std::size_t i, const MotionParameters& parameters) const;
};

MotionChain motion_chain(const DriveMotion& drive);
/// Without the poses [first, last).
MotionChain without(const MotionChain& chain, std::size_t first, std::size_t last);

/// Odometry's step against the laser's, in the frame of the step's end: x, y, yaw.
std::optional<Eigen::Vector3d> step_error(const MotionChain& chain, std::size_t i,
                                          const MotionParameters& parameters);

/// Estimates the noise from how errors grow with the length of a window: errors of odometry's steps add up,
/// errors of the laser's poses enter only at both ends. Uses medians, so that slip and lost scans do not
/// count.
MotionNoise estimated_noise(const MotionChain& chain, const MotionParameters& parameters,
                            const MotionNoise& before);

/// Uncertainty assumed for described values, 1 sigma, used where the drive does not determine them.
double kept_sigma(MotionParameter parameter);

struct MotionFit {
  MotionParameters parameters;
  MotionNoise noise;
  /// Of all parameters; for those that were not fitted, the uncertainty assumed for described values.
  Eigen::Matrix<double, kMotionParameters, kMotionParameters> information;
  std::vector<Pose2> poses;  ///< T_map_base
};

/// `free`: parameters to fit; the others stay at `start`. `rounds` of estimating the
/// noise and three steps of Gauss-Newton; fewer suffice from a good start. nullopt where the equations have
/// no solution.
std::optional<MotionFit> fit_motion(const MotionChain& chain, const MotionParameters& start,
                                    const std::array<bool, kMotionParameters>& free, int rounds = 7);

/// The jitter of stamps: the part of the laser's errors, which enter two steps with opposite signs, that
/// grows with the square of the speed; the rest is a line's offset.
Measured jitter_of(const MotionChain& chain, const MotionParameters& parameters);

/// A start for fit_motion: the time offset within 1 s, and the quarter turn of the laser's mounting, at which
/// odometry agrees best with the laser.
MotionParameters rough_start(const MotionChain& chain, const MotionParameters& start);

}  // namespace parhelion::pose
