// Follows the robot from scan to scan in a surfel map: with odometry as prior, and where scans contradict
// odometry, with the motion of the scans before.
#pragma once

#include <limits>
#include <optional>

#include "fusion/pose/matching/map_accuracy.hpp"
#include "fusion/pose/matching/match_consistency.hpp"
#include "fusion/pose/matching/scan_match.hpp"
#include "fusion/pose/matching/scan_points.hpp"
#include "fusion/pose/odometry/frozen_odometry.hpp"
#include "fusion/pose/odometry/odometry_sanity.hpp"
#include "fusion/pose/odometry/scan_odometry.hpp"
#include "fusion/pose/search/wide_search.hpp"
#include "fusion/pose/tracking/stuck_odometry.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

/// Odometry error over a motion: covariance of x, y, yaw in the frame of its end. `min_sigma`: m, of the
/// position where the robot stands.
Eigen::Matrix3d odometry_covariance(const RobotDescription& robot, double driven, double turned,
                                    double min_sigma = 0.002);
/// The covariance of a pose, propagated over a motion; all in the map frame.
Eigen::Matrix3d propagated_covariance(const Eigen::Matrix3d& covariance, const Pose2& before,
                                      const Pose2& after, const Eigen::Matrix3d& step_covariance);

class ScanTracking {
 public:
  struct Options {
    /// m; no match is taken that contradicts odometry by so much more than a robot moves between scans.
    double max_leap = std::numeric_limits<double>::infinity();
    double min_odometry_error = 0.002;  ///< m, 1 sigma, of a step
    /// The map grows with the scans: a match about what odometry predicts is refined as
    /// MatchOptions::growing.
    bool growing = false;
    bool has_odometry = true;  ///< as SlamOptions
  };
  ScanTracking(const RobotDescription& robot, const Options& options)
      : robot_(robot), options_(options), sanity_(options.has_odometry) {}

  /// As SLAM uses it, corrected.
  void add(const Odometry& odometry) {
    sanity_.add(odometry);
    stuck_.add(odometry);
  }
  /// The robot's twist at a scan: that of odometry, while it can be trusted.
  Twist2 twist_at(const Twist2& odometry) const;

  struct Where {
    Pose2 T_map_base;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< x, y, yaw, map frame
  };
  struct Followed {
    Match match;
    Where expected;  ///< prediction and prior that the match was made with
    bool by_odometry = true;
  };
  /// The maps that scans are matched to.
  struct Maps {
    const SurfelMap& fine;
    const SurfelMap& coarse;
    WideSearch wide_search;  ///< asked where no match near the predicted pose explains the scan; may be empty
  };
  /// `before`: where the robot was at the previous scan.
  Followed follow(const Maps& maps, const ScanPoints& scan, const Where& before,
                  const ScanOdometry::Step& step, const MatchOptions& options);
  /// The pose has been set by something else: what it was before says nothing about the motion.
  void forget();
  /// The robot was picked up, and then found again somewhere else.
  void picked_up(SensorTime now) { sanity_.picked_up(now); }
  void found_again(SensorTime now) {
    forget();
    sanity_.found_again(now);
  }
  /// The map was corrected, and the robot with it: its motion goes on from here.
  void continue_from(const Pose2& T_map_base) {
    by_scans_alone_ = T_map_base;
    frozen_.forget();
  }

  /// The covariance to publish (x, y, yaw) for a pose whose filter has `covariance`. The filter believes that
  /// the points of each scan are worth as much in every building; what is published is what scans were seen
  /// to be worth (match_consistency.hpp), how far the map's own scans are apart (map_accuracy.hpp), and the
  /// turn during the sweep, which odometry and scans tell differently.
  Eigen::Matrix3d published(const Eigen::Matrix3d& covariance) const;

  /// m/s, as scans show it; 0 where they do not.
  double speed() const { return motion_.known ? motion_.step.position().norm() / motion_.interval : 0; }
  OdometryFault fault() const { return sanity_.fault(); }
  bool is_odometry_suspected() const { return sanity_.is_suspected(); }
  bool is_mounting_doubtful() const { return sanity_.is_mounting_doubtful(); }
  const std::vector<OdometryFinding>& findings() const { return sanity_.findings(); }

 private:
  Where by_odometry(const Where& before, const ScanOdometry::Step& step) const;
  double intervals_until(SensorTime stamp) const;
  Pose2 moved_on(const ScanPoints& scan, double intervals) const;
  Where by_scans(const ScanPoints& scan, const Where& before) const;
  bool may_search_widely(SensorTime stamp) const;
  bool is_stray(SensorTime stamp, const Pose2& found, const Pose2& odometry, const Pose2& scans) const;
  /// A scan's match, and the match that scans give without odometry.
  struct Candidates {
    Followed chosen;
    Match free;
  };
  Candidates candidates(const Maps& maps, const ScanPoints& scan, const Where& odometry, const Where& scans,
                        bool trusted, bool agrees, const MatchOptions& options) const;
  Match after_other_intervals(const Maps& maps, const ScanPoints& scan, const Eigen::Matrix3d& prior,
                              const Match& found, const MatchOptions& options) const;
  Match refined(const Maps& maps, const ScanPoints& scan, const Followed& found,
                const MatchOptions& options) const;
  bool is_trusted(const ScanOdometry::Step& step, SensorTime stamp);
  std::optional<Followed> driven_on(const Maps& maps, const ScanPoints& scan, const Where& before,
                                    const Match& standing, const MatchOptions& options) const;
  std::optional<Followed> moved_off(const Maps& maps, const ScanPoints& scan, const Where& before,
                                    const Match& standing, const MatchOptions& options);
  void learn_interval(SensorTime stamp);
  void compare_twists(SensorTime stamp, const Pose2& before, const Pose2& after, const Twist2& odometry);
  void weigh(const Maps& maps, const ScanPoints& scan, const MatchOptions& options, const Match& found);
  void check_odometry(const ScanPoints& scan, const ScanOdometry::Step& step, const Match& free);
  bool moves_smoothly() const;
  bool is_leap(SensorTime stamp, const Pose2& found, const Pose2& odometry) const;
  bool is_announced(const Pose2& found, const Pose2& predicted, SensorTime stamp) const;
  void follow_alone(const ScanPoints& scan, const Pose2& before, const Pose2& predicted, const Match& chosen,
                    const Match& free);
  void go_on_from(const Pose2& T_map_base, const Pose2& step);
  void learn(const Pose2& step);

  static constexpr std::size_t kWeighedPoints = 240;

  RobotDescription robot_;
  Options options_;
  OdometrySanity sanity_;
  MatchConsistency consistency_{kWeighedPoints};
  MapAccuracy map_accuracy_{kWeighedPoints};
  /// Motion is taken as constant: in time, or, where stamps are irregular, from scan to scan.
  struct Motion {
    Pose2 step;
    bool known = false;
    double position_variance = 0, yaw_variance = 0;  ///< m^2 along one axis, rad^2: of such predictions
    double interval = 0.1;                           ///< s between scans
    double irregularity = 0;                         ///< mean deviation from that, as a fraction
  };
  Motion motion_;
  FrozenOdometry frozen_;
  StuckOdometry stuck_;
  std::optional<ScanPoints> previous_;
  Pose2 by_scans_alone_;             ///< T_map_base at the previous scan
  bool alone_is_predicted_ = false;  ///< that scan matched nothing
  double twist_off_ = 0;  ///< rad/s: odometry's rotation against that of the scans, at the last scan
  SensorTime matched_;    ///< stamp of the last scan that the map explained
  SensorTime searched_;   ///< stamp of the last scan that was searched for widely
};

}  // namespace parhelion::pose
