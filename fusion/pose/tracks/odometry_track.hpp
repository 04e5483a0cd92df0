// Wheel odometry at any instant: interpolated along arcs of constant twist, extrapolated with the last twist.
#pragma once

#include <cstdint>
#include <optional>

#include "fusion/pose/tracks/ring.hpp"
#include "protocols/pose.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// Odometry at an instant.
struct OdometryAtInstant {
  Pose2 T_odom_base;  ///< pose of base_link in odom
  double driven = 0;  ///< m, path length up to here; only differences are meaningful
  double turned = 0;  ///< rad, the same for rotation
  double ahead = 0;   ///< s after the last sample
  Twist2 twist;       ///< body frame
};

class OdometryTrack {
 public:
  enum class Added {
    accepted,
    rejected,   ///< not finite, or a backward stamp
    restarted,  ///< accepted as the first after a restart of the sensor's clock
  };
  enum class Missing { none_there, older_than_history, too_far_ahead };

  OdometryTrack(Duration history, Duration max_extrapolation);

  /// A stamp that jumps back by more than the history means that the sensor's clock restarted. Never
  /// allocates.
  Added add(const Odometry& odometry);
  /// nullopt: `missing` (out, may be null) has the reason.
  std::optional<OdometryAtInstant> at(SensorTime t, Missing* missing = nullptr) const;
  /// Least time over which a twist is computed; 40 ms unless set. Stamps that jitter ask for more.
  void set_twist_span(Duration span) { twist_span_ = span; }
  bool empty() const { return samples_.count() == 0; }
  SensorTime newest_stamp() const { return samples_.newest().stamp; }

 private:
  struct Sample {
    SensorTime stamp;
    Pose2 T_odom_base;
    double driven = 0, turned = 0;
  };
  Twist2 twist_ending_at(std::size_t age) const;

  Duration history_, max_extrapolation_;
  Duration twist_span_;
  Ring<Sample> samples_;
};

}  // namespace parhelion::pose
