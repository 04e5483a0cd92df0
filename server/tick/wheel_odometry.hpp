// Odometry from the wheel encoders of both sides, with the systematic errors of wheels.
#pragma once

#include <cstdint>

#include "protocols/pose.hpp"

namespace parhelion::tick {

/// Errors of a differential, skid-steered or tracked drive. The two systematic ones are those of Borenstein
/// and Feng (UMBmark, IEEE Trans. Robotics and Automation 12(6), 1996): unequal wheels (E_d) and an uncertain
/// wheelbase (E_b); noise per metre as in Thrun, Burgard, Fox, Probabilistic Robotics, section 5.4.
struct WheelOdometryErrors {
  double left = 0, right = 0;  ///< of each side's radius: 0.01 measures 1 % more than was travelled
  double track = 0;            ///< of the width: 0.01 assumes it 1 % wider, and measures smaller turns
  double noise = 0;            ///< m, 1 sigma of a side after one metre
  double tick = 0;             ///< m of a side's travel per encoder tick; 0: continuous
};

/// Drawn from the seed, so that the errors are constant during a session; `translation` and `rotation`: 1
/// sigma per metre and per radian, as in a robot description.
WheelOdometryErrors draw_wheel_errors(std::uint64_t seed, double translation, double rotation, double track);

/// Dead reckoning on exact arcs. Slip causes an error, as only the encoders are read.
class WheelOdometry {
 public:
  /// `track`: m between the sides. Noise is keyed by (seed, sample).
  WheelOdometry(double track, const WheelOdometryErrors& errors, std::uint64_t seed);

  /// The travel of both sides since their start, m. The first call sets both to zero, and so does a changed
  /// `epoch` (the robot was reset, and its encoders with it): no motion then.
  Odometry add(SensorTime stamp, double left, double right, std::uint32_t epoch);

 private:
  struct Side {
    double travelled = 0;  ///< m, true
    double measured = 0;   ///< m, with the errors, before quantization
    double counted = 0;    ///< m, in whole ticks
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
