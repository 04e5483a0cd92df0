// Least squares of a sensor's turns against headings by scans. Internal to turn_calibration.cpp.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "fusion/pose/calibration/drive_motion.hpp"
#include "fusion/pose/calibration/turn_path.hpp"

namespace parhelion::pose {

inline constexpr std::size_t kTurnParameters = 3;
/// Time offset, s; scale; bias, rad/s.
using TurnValues = Eigen::Vector3d;
using TurnSigmas = Eigen::Vector3d;
using TurnFree = std::array<bool, kTurnParameters>;

/// Consecutive scans. The absolute heading of a window is unknown.
struct TurnWindow {
  const TurnPath* sensor = nullptr;
  std::vector<SensorTime> stamp;
  std::vector<double> heading;  ///< rad, of the laser since the first, unwrapped
};

/// Windows of some seconds over the whole drive where the sensor was on.
std::vector<TurnWindow> turn_windows(const std::vector<LaserPose>& laser, const TurnPath& sensor);

/// 1 sigma.
struct TurnNoise {
  double heading = 0;  ///< rad, of a heading by the scans against the sensor at rest
  double jitter = 0;   ///< s, of the stamps of scans and sensor against each other
};

struct TurnFit {
  TurnValues values;
  TurnSigmas sigmas;  ///< as independent errors of headings would make them
  TurnNoise noise;
  std::size_t outliers = 0;
};

/// heading = scale (turned(t - offset) - bias t) + a constant a window; robust. What is not `free` stays at
/// `start`. nullopt where the equations have no solution.
std::optional<TurnFit> fit_turns(const std::vector<TurnWindow>& windows, const TurnValues& start,
                                 const TurnFree& free);

/// The offset within 1 s of `start`, in steps of 20 ms, at which the sensor agrees best with the scans;
/// `start` where none is clearly better.
double rough_offset(const std::vector<TurnWindow>& windows, double start);
/// Rotation measured by the sensor per radian of rotation of the scans.
double turn_ratio(const std::vector<TurnWindow>& windows, double offset);

}  // namespace parhelion::pose
