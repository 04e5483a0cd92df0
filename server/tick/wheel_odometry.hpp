// What the encoders of both sides make of a drive: odometry that drifts as wheels do.
#pragma once

#include <cstdint>

#include "protocols/pose.hpp"

namespace parhelion::tick {

/// Errors of a differential, skid-steered or tracked drive. The two systematic ones are those of Borenstein
/// and Feng (UMBmark, IEEE Trans. Robotics and Automation 12(6), 1996): unequal wheels (E_d) and an uncertain
/// wheelbase (E_b); noise per metre as in Thrun, Burgard, Fox, Probabilistic Robotics, section 5.4.
struct WheelOdometryErrors {
  double left = 0, right = 0;  ///< of each side's radius: 0.01 says 1 % more than was rolled
  double track = 0;            ///< of the width: 0.01 takes it for 1 % wider, and turns for smaller
  double noise = 0;            ///< m, 1 sigma of a side after a metre
  double tick = 0;             ///< m of a side's travel that an encoder resolves, 0: all
};

/// Drawn from the seed, so that a robot drives with the same wheels all session long; `translation` and
/// `rotation`: 1 sigma per metre and per radian, as a robot description gives them.
WheelOdometryErrors draw_wheel_errors(std::uint64_t seed, double translation, double rotation, double track);

/// Dead reckoning on exact arcs. What slips shows: only the encoders are read.
class WheelOdometry {
 public:
  /// `track`: m between the sides. Noise is keyed by (seed, sample).
  WheelOdometry(double track, const WheelOdometryErrors& errors, std::uint64_t seed);

  /// The travel of both sides since their start, m. Both start at zero with the first call, and again where
  /// `epoch` differs from the last call's (the robot was reset, its encoders with it): no motion then.
  Odometry add(SensorTime stamp, double left, double right, std::uint32_t epoch);

 private:
  struct Side {
    double travelled = 0;  ///< m, as it is
    double measured = 0;   ///< with the errors, before rounding to ticks
    double counted = 0;    ///< whole ticks
  };
  double advance(Side& side, double travelled, double error, std::size_t draw);

  double track_;
  WheelOdometryErrors errors_;
  std::uint64_t seed_;
  std::uint64_t samples_ = 0;
  std::uint32_t epoch_ = 0;
  Side left_, right_;
  double x_ = 0, y_ = 0, yaw_ = 0;
};

}  // namespace parhelion::tick
