// The robot's own pose at the instant of a scan: the scan matched to a map that does not change, from the
// pose that odometry predicts. An iterated extended Kalman update (scan_match.hpp), so that along a corridor,
// where a scan says nothing, the prediction decides and the covariance says so.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "fusion/pose/maps/matching_map.hpp"
#include "fusion/pose/matching/map_accuracy.hpp"
#include "fusion/pose/matching/match_consistency.hpp"
#include "fusion/pose/matching/scan_match.hpp"
#include "fusion/pose/odometry/scan_motion.hpp"
#include "fusion/pose/tracks/attitude_track.hpp"
#include "protocols/pose2.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"

namespace parhelion::pose {

/// What is known before the match, at the scan's stamp.
struct MatchPrior {
  Pose2 T_map_base;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();   ///< x, y, yaw, map frame
  Twist2 twist;                                           ///< body frame
  std::optional<Attitude> attitude = std::nullopt;        ///< none: not measured
  std::optional<ScanMotion::Step> before = std::nullopt;  ///< the last scan that was matched
};

/// How a scan was placed.
enum class ScanMatch : std::uint8_t {
  matched,
  off,           ///< no map, or the scenario says so
  no_prior,      ///< no pose, no odometry, or no word from SLAM for a while
  few_points,    ///< fewer than ten returns
  unexplained,   ///< too few returns lie on the map's surfaces: people around the robot, another place
  beyond_prior,  ///< farther from the prediction than it can be wrong
};
const char* to_string(ScanMatch match);

struct RefinedPose {
  ScanMatch match = ScanMatch::off;
  Pose2 T_map_base;                                      ///< valid where matched
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< x, y, yaw, map frame; valid where matched
  Twist2 twist;          ///< body frame, during the sweep; valid where matched
  double residual = 0;   ///< m, RMS distance of the explained returns from the map's surfaces
  double explained = 0;  ///< fraction of the returns used that lie on the map's surfaces
};

/// The sweep is corrected for the robot's motion with odometry's twist at first. That may be late, or jitter
/// with odometry's stamps; the scans' own poses say what the twist is, with constant acceleration over the
/// last two steps. Where it differs, the points are placed again, and the match goes on from there.
///
/// Bounded work for each scan: at most `kPoints` returns are used, and the number of iterations is fixed.
/// Never allocates after the first scan. Deterministic.
class ScanRefiner {
 public:
  static constexpr std::size_t kPoints = 240;

  ScanRefiner(const LaserDescription& laser, std::shared_ptr<const MatchingMap> map);

  RefinedPose refine(const Scan& scan, const MatchPrior& prior);

 private:
  void find_hits(const Scan& scan);
  void place_points(const Scan& scan, const Twist2& twist, const std::optional<Attitude>& attitude);
  /// The twist in the middle of the sweep, and what of it is acceleration since the last step: that is
  /// uncertain.
  struct SweepTwist {
    Twist2 twist, gained;
  };
  std::optional<SweepTwist> twist_by_scans(const Scan& scan, const MatchPrior& prior,
                                           const Pose2& found) const;
  void refine_twist(const Scan& scan, const MatchPrior& prior, const Eigen::Matrix3d& information,
                    const MatchOptions& options, Match& found, Twist2& twist);
  void weigh_by_consistency(const MatchPrior& prior, const Eigen::Matrix3d& information, Match& found) const;
  Eigen::Matrix3d covariance_of(const Scan& scan, const MatchPrior& prior, const Eigen::Matrix3d& information,
                                const Match& found) const;

  LaserDescription laser_;
  std::shared_ptr<const MatchingMap> map_;
  MatchConsistency consistency_;
  MapAccuracy map_accuracy_;
  std::vector<std::uint32_t> hits_;            ///< beams
  std::vector<Eigen::Vector2d> points_, few_;  ///< m, base_link at the stamp
};

}  // namespace parhelion::pose
