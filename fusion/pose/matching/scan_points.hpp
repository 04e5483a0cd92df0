// A scan as points in base_link at the scan's stamp, corrected beam by beam for the motion during the sweep.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "fusion/pose/matching/sweep_motion.hpp"
#include "fusion/pose/tracks/attitude_track.hpp"
#include "protocols/pose2.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"

namespace parhelion::pose {

struct ScanPoints {
  SensorTime stamp;
  Eigen::Vector2d laser = Eigen::Vector2d::Zero();  ///< m, base_link
  std::vector<Eigen::Vector2d> points;  ///< m, base_link at the stamp; hits only, in the order of the beams
  std::size_t beams = 0;                ///< of the scan that the points come from, as its angles
  float angle_min = 0, angle_increment = 0;  ///< rad
  std::uint64_t ranges_hash = 0;             ///< of the scan's ranges
  /// T_stamp_middle of the base, to the mean time of the hits, as it was assumed when they were placed. What
  /// a match says of the base then does not depend on that.
  Pose2 to_middle;
};

/// Places the hits of one scan in base_link.
class Deskewing {
 public:
  /// `motion`: of the base during the sweep. `attitude`: of the base, where it is measured; points are then
  /// in a level frame with the base's origin and heading.
  Deskewing(const LaserDescription& laser, const SweepMotion& motion,
            const std::optional<Attitude>& attitude);

  /// m, base_link at the stamp, projected to the floor plane. nullopt: no hit, or, on a robot whose attitude
  /// is measured, a return from floor or ceiling.
  std::optional<Eigen::Vector2d> point(const Scan& scan, std::size_t beam) const;
  /// The laser's place, m.
  Eigen::Vector2d laser() const { return T_base_laser_.translation().head<2>(); }

 private:
  const LaserDescription& laser_;
  SweepMotion motion_;
  Transform<Base, Laser> T_base_laser_;
  double lowest_, highest_;  ///< m, heights over the base between which returns are from walls
};

ScanPoints deskewed(const Scan& scan, const LaserDescription& laser, const SweepMotion& motion,
                    const std::optional<Attitude>& attitude = {});

/// The scan that a robot at rest at the stamp would have taken: the points resampled at regular beam angles,
/// interpolated on the line between neighbours. NaN: unknown.
Scan rectified(const ScanPoints& scan, const LaserDescription& laser);

/// At most `count` points, spread evenly over the scan.
std::vector<Eigen::Vector2d> thinned(std::span<const Eigen::Vector2d> points, std::size_t count);

}  // namespace parhelion::pose
