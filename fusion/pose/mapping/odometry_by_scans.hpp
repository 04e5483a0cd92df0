// Odometry made of scans, for a robot that reports none: each scan is matched to those of the last metres.
#pragma once

#include <memory>
#include <optional>

#include "fusion/pose/mapping/slam_front_end.hpp"
#include "fusion/pose/tracks/attitude_track.hpp"
#include "protocols/pose.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"

namespace parhelion::pose {

/// Bounded in memory. Deterministic.
class OdometryByScans {
 public:
  /// `robot` has a laser.
  explicit OdometryByScans(const RobotDescription& robot);

  /// Roll and pitch are taken out of scans.
  void add_inertial(const ImuSample& sample) { attitude_.add(sample); }
  /// At the scan's stamp, from where the first scan was. nullopt for a scan without returns. Nothing
  /// notices that a robot is picked up.
  std::optional<Odometry> add(const Scan& scan);

 private:
  struct Track {
    std::unique_ptr<SlamFrontEnd> front_end;
    int scans = 0;
  };
  Track begin() const;
  SlamFrontEnd::Estimate follow(Track& track, const Scan& scan) const;
  void renew(const Scan& scan);

  RobotDescription robot_;
  AttitudeTrack attitude_;
  Pose2 T_odom_base_;  ///< at the last scan
  Track now_;
  std::optional<Track> next_;  ///< takes over where the map of `now_` becomes large
};

}  // namespace parhelion::pose
