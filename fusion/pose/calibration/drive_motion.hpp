// The motion of a drive as three sensors saw it: the laser against the walls, the wheels, and, where there is
// one, a reference.
#pragma once

#include <optional>
#include <vector>

#include "protocols/pose.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// A pose of the laser by scan matching.
struct LaserPose {
  SensorTime stamp;    ///< of the scan
  Pose2 T_map_laser;   ///< map: any frame that is the same for the whole drive
  bool linked = true;  ///< false: nothing is known of the motion since the previous one
};

struct DriveMotion {
  std::vector<Odometry> odometry;      ///< raw, in the order of arrival
  std::vector<LaserPose> laser;        ///< in the order of arrival
  std::vector<PoseStamped> reference;  ///< of the base, in any map frame; may be empty
};

/// Raw odometry of a whole drive at any instant.
class OdometryPath {
 public:
  /// Samples that are not finite or not later than all before them are left out and counted.
  explicit OdometryPath(const std::vector<Odometry>& odometry);

  /// T_odom_base, interpolated along an arc; nullopt outside of the drive and in a gap of over 0.5 s.
  std::optional<Pose2> at(SensorTime t) const;
  /// The motion between two instants of the odometry's own clock.
  std::optional<Pose2> step(SensorTime from, SensorTime to) const;
  std::size_t samples() const { return samples_.size(); }
  std::size_t left_out() const { return left_out_; }

 private:
  struct Sample {
    SensorTime stamp;
    Pose2 T_odom_base;
  };
  std::vector<Sample> samples_;
  std::size_t left_out_ = 0;
};

}  // namespace parhelion::pose
