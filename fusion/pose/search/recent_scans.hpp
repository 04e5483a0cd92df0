// The last metres of a drive as a small map of their own, for a robot that does not know where it is: what it
// has seen so far, seen from where it is now.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <vector>

#include "fusion/pose/matching/scan_points.hpp"
#include "fusion/pose/matching/surfel_map.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// From the laser to a return; m, base_link now.
struct SeenBeam {
  Eigen::Vector2d from, to;
};

class RecentScans {
 public:
  static constexpr std::size_t kScans = 14, kBeamsPerScan = 40;

  /// `odometry`: motion of the base since the previous scan, a first guess. False: the scan does not continue
  /// the ones before, which are forgotten (the robot was carried, or the laser shows garbage).
  bool add(const ScanPoints& scan, const Pose2& odometry);
  void clear();

  /// The motion of the base since the previous scan, as the scans show it.
  const Pose2& step() const { return step_; }
  /// Of this scan and of earlier ones some 0.3 m or 0.3 rad apart; at most (kScans + 1) * kBeamsPerScan.
  const std::vector<SeenBeam>& beams() const { return beams_; }

 private:
  struct Kept {
    std::vector<Eigen::Vector2d> points;  ///< m, base_link at the scan
    Eigen::Vector2d laser;                ///< the same
    Pose2 T_local_base;
  };
  void keep(const ScanPoints& scan);
  void gather(const ScanPoints& scan);
  void see(const std::vector<Eigen::Vector2d>& points, const Eigen::Vector2d& laser, const Pose2& T_now_base);

  SurfelMap fine_{0.1}, coarse_{0.4};
  std::deque<Kept> kept_;
  Pose2 T_local_base_, step_;
  std::vector<SeenBeam> beams_;
};

}  // namespace parhelion::pose
