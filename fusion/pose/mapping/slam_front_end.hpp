// The SLAM front end: each scan is matched to the surfels of the recent path.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "fusion/pose/mapping/companions.hpp"
#include "fusion/pose/mapping/displacement_check.hpp"
#include "fusion/pose/mapping/heading_drift.hpp"
#include "fusion/pose/mapping/keyframe.hpp"
#include "fusion/pose/mapping/new_ground.hpp"
#include "fusion/pose/mapping/unmeasured_motion.hpp"
#include "fusion/pose/matching/scan_match.hpp"
#include "fusion/pose/matching/surfel_map.hpp"
#include "fusion/pose/odometry/odometry_scale.hpp"
#include "fusion/pose/tracking/held_pose.hpp"
#include "fusion/pose/tracking/pose_doubt.hpp"
#include "fusion/pose/tracking/scan_tracking.hpp"
#include "protocols/pose.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

/// A loop was closed: the poses of all keyframes, of which the first is fixed, and an old keyframe whose
/// place the robot is back at.
struct LoopCorrection {
  std::vector<Pose2> poses;
  std::size_t revisited = 0;
  std::size_t known_until = 0;  ///< keyframes that there were when the loop was seen
};

class SlamFrontEnd {
 public:
  struct Options {
    double cell = 0.1;                ///< m
    double keyframe_distance = 0.15;  ///< m
    double keyframe_angle = 0.1;      ///< rad
    double window = 25;               ///< m of path that the local map covers
    double surroundings = 10;         ///< m: the same for old keyframes around the robot, after a loop
    double joined = 12;               ///< m of path after a loop closure
    bool doubt_mounting = true;       ///< as SlamOptions
    bool has_odometry = true;         ///< as SlamOptions
    MatchOptions match{.by_direction = true};
  };
  struct Estimate {
    Pose2 T_map_base;
    /// x, y, yaw, map frame: of the match, and of the drift since the start or the last loop.
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    Pose2 moved;  ///< since the previous scan, by odometry where that leads, else by the scans
    double explained = 0;
    SlamState state = SlamState::tracking;
    bool keyframe = false;
  };

  SlamFrontEnd(const RobotDescription& robot, const Options& options);

  void add(const Odometry& odometry) {
    tracking_.add(odometry);
    scale_.add(odometry);
    unmeasured_.add(odometry);
  }
  /// `reported`: odometry since the previous scan; the first scan is at `start`.
  Estimate add(const ScanPoints& whole_scan, const ScanOdometry::Step& reported);
  void set_start(const Pose2& start) { pose_ = start; }
  const ScanTracking& tracking() const { return tracking_; }
  const OdometryScale& scale() const { return scale_; }
  const std::vector<Keyframe>& keyframes() const { return keyframes_; }
  /// Keyframes in the map that scans are matched to.
  std::size_t keyframes_in_map() const {
    return static_cast<std::size_t>(std::count(in_map_.begin(), in_map_.end(), 1));
  }
  /// Moves the keyframes, the robot with the last, and from here on matches to the old surroundings, too.
  void correct(const LoopCorrection& correction);
  /// The first keyframe whose pose has changed since the last call, as the path was bent with its walls.
  std::optional<std::size_t> take_bent() { return std::exchange(bent_from_, std::nullopt); }
  /// The robot was picked up: it is lost, and nothing is added to the map, until it is found.
  bool is_displaced() const { return displaced_; }
  /// Fraction of the points of a scan.
  double usually_explained() const { return check_.usually_explained(); }
  /// Where it is, by a search of the map; `scan` is the one that was added last.
  void found(const Pose2& T_map_base, const ScanPoints& scan);

 private:
  void learn_scale(SensorTime stamp);
  std::optional<Match> search_surroundings(const ScanPoints& scan, const Pose2& around) const;
  Pose2 track(const ScanPoints& scan, const ScanOdometry::Step& step, Estimate& estimate);
  void add_weak_motion(const Pose2& before, const ScanTracking::Followed& found,
                       const ScanOdometry::Step& step);
  void watch(const ScanPoints& scan, const Pose2& before, const ScanOdometry::Step& step, Estimate& estimate);
  void wait(const ScanPoints& scan, const ScanOdometry::Step& step, Estimate& estimate);
  void step_aside(const Match& beside, SensorTime stamp, Estimate& estimate);
  bool is_undisturbed(const ScanPoints& scan);
  bool is_new_ground(const ScanPoints& scan, const ScanOdometry::Step& step, double explained);
  void go_on_in_new_ground(const ScanPoints& scan);
  void go_on(const Pose2& T_map_base, SensorTime stamp);
  SlamState state(SensorTime stamp) const;
  ScanPoints without_companions(const ScanPoints& scan, const ScanOdometry::Step& step);
  void keep(const ScanPoints& scan, double explained);
  Eigen::Matrix3d step_information() const;  ///< from the last keyframe to here
  Eigen::Matrix3d drift_per_metre() const;
  Eigen::Matrix3d drift_by_matches(const Pose2& pose) const;
  Eigen::Matrix3d drift_by_odometry(const Eigen::Vector2d& unseen) const;
  Eigen::Matrix3d drift_at(const Pose2& pose) const;
  void learn_drift(const Eigen::Vector3d& correction, const Eigen::Matrix3d& expected);
  void straighten();
  void update_local_map();
  void put(std::size_t keyframe, double weight);

  RobotDescription robot_;
  Options options_;
  ScanTracking tracking_;
  HeldPose held_;
  OdometryScale scale_;
  Companions companions_;
  SurfelMap fine_, coarse_;
  std::vector<Keyframe> keyframes_;
  std::vector<char> in_map_;     ///< per keyframe
  bool is_map_complete_ = true;  ///< no keyframe waits to be added
  HeadingDrift heading_;
  std::optional<std::size_t> bent_from_;  ///< first keyframe
  double joined_until_ = 0;               ///< m of path, up to which old surroundings fit to the new ones
  Pose2 pose_;
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d shown_ = Eigen::Matrix3d::Zero();  ///< information of the last match; zero where it failed
  /// As Keyframe::unseen, since the start or the last loop.
  Eigen::Vector2d unseen_ = Eigen::Vector2d::Zero();
  UnmeasuredMotion unmeasured_;
  NewGround new_ground_;
  bool came_unmeasured_ = false;  ///< to this part of the map, over ground that nothing measured
  std::size_t broken_at_ = 0;     ///< first keyframe after the last place where nothing measured the way
  WeakMotion weak_motion_;        ///< since the last keyframe, map frame
  Eigen::Matrix3d drift_per_metre_ = Eigen::Matrix3d::Zero();  ///< x, y, yaw, map frame; at the last keyframe
  /// Sums over the loops so far: squared corrections in sigmas of the drift that was expected, and
  /// directions.
  double drift_squares_ = 6, drift_directions_ = 6;
  double driven_ = 0, turned_ = 0;
  double driven_at_keyframe_ = 0, turned_at_keyframe_ = 0;
  std::size_t scans_ = 0;
  SensorTime matched_;  ///< stamp of the last scan that the map explained
  PoseDoubt doubt_;
  DisplacementCheck check_;
  bool displaced_ = false;
  bool is_led_by_odometry_ = true;         ///< the last scan
  std::optional<SensorTime> exact_since_;  ///< that a displaced robot seems to be where it was
};

}  // namespace parhelion::pose
