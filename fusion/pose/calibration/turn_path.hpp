// How far a sensor has turned about the robot's vertical axis, at any instant of the sensor's own clock: from
// yaw rates of an inertial sensor, or from turns between images.
#pragma once

#include <optional>
#include <vector>

#include "protocols/joints.hpp"
#include "protocols/robot.hpp"
#include "protocols/time.hpp"

namespace parhelion::pose {

/// A turn between two instants; its sign is that of base_link (REP-103).
struct Turn {
  SensorTime from, to;
  double angle = 0;  ///< rad
};

class TurnPath {
 public:
  /// Integrates rates, linear between two samples; without any rate, the sensor's own orientation is used.
  /// The base counts as level. Samples that are not finite or not later than all before are left out.
  TurnPath(const std::vector<ImuSample>& samples, const ImuDescription& imu);
  /// `turns`: in the order of time; between two that do not join nothing is known.
  explicit TurnPath(const std::vector<Turn>& turns);

  /// rad; cubic between samples, with their rates (Hermite). nullopt outside of the samples, and across a gap
  /// of over 0.5 s.
  std::optional<double> between(SensorTime from, SensorTime to) const;
  std::size_t samples() const { return knots_.size(); }

 private:
  struct Knot {
    SensorTime stamp;
    double angle = 0;  ///< rad, since the first
    double rate = 0;   ///< rad/s
    int part = 0;      ///< between two parts lies a gap
  };
  struct Place {
    double angle = 0;
    int part = 0;
  };
  std::optional<Place> at(SensorTime t) const;
  void add(Knot knot, double turned);
  void add_rates_of_angles();

  std::vector<Knot> knots_;
};

}  // namespace parhelion::pose
