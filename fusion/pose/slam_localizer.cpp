#include <Eigen/LU>

#include "fusion/pose/estimate.hpp"
#include "fusion/pose/frozen_map.hpp"
#include "fusion/pose/localizer_search.hpp"
#include "fusion/pose/own_slam.hpp"
#include "fusion/pose/scan_odometry.hpp"
#include "fusion/pose/slam.hpp"
#include "fusion/pose/slam_front_end.hpp"

namespace parhelion::pose {
namespace {

constexpr double kMinExplained = 0.35;  ///< minimum for a valid scan (people may surround the robot)
constexpr double kFoundAgain = 0.55;    ///< fraction of explained points that ends the lost state
constexpr int kPatience = 10;           ///< consecutive scans without estimate before the lost state
constexpr double kLostSigma = 0.3;      ///< m
constexpr int kRetryEvery = 5;          ///< lost scans between two searches near the expected pose
constexpr int kGiveUpAfter = 40;        ///< lost scans before a global search
constexpr double kStartSigma = 0.3, kStartYawSigma = 0.15;  ///< m, rad: uncertainty of `start`
constexpr std::size_t kMinPoints = 10;

class Localizer final : public Slam {
 public:
  Localizer(const RobotDescription& robot, FrozenMap map, const SlamOptions& options)
      : robot_(robot), map_(std::move(map)), odometry_(robot.odometry), attitude_(robot.imu) {
    match_.range_sigma = map_.sigma;
    if (!options.start) return;
    pose_ = {options.start->x(), options.start->y(), options.start->z()};
    mode_ = Mode::starting;
  }

  void add(const Odometry& odometry) override { odometry_.add(odometry); }
  void add_inertial(const ImuSample& sample) override { attitude_.add(sample); }

  std::optional<PoseEstimate> add(const Scan& scan) override {
    const auto attitude = attitude_.at(scan.stamp);
    const auto step = odometry_.step_to(scan.stamp, attitude);
    if (!step) return std::nullopt;
    const ScanPoints points = deskewed(scan, *robot_.laser, step->twist, attitude);
    switch (mode_) {
      case Mode::searching:
        search(points, step->step);
        break;
      case Mode::starting:
        start(points, step->step);
        break;
      case Mode::tracking:
        track(points, *step);
        break;
      case Mode::lost:
        recover(points, *step);
        break;
    }
    PoseEstimate estimate = planar_estimate(scan.stamp, pose_, covariance_, state());
    estimate.map_id = map_.grid.id;
    return estimate;
  }

  std::vector<PoseEstimate> finish() override { return {}; }
  GridMap grid_map() const override { return map_.grid; }
  Status save_simplemap(const std::string& path) const override {
    return Error{path + ": localization does not build a map; omit --map to build one"};
  }

 private:
  enum class Mode { searching, starting, tracking, lost };

  SlamState state() const {
    if (mode_ == Mode::tracking) return SlamState::tracking;
    return mode_ == Mode::lost || was_tracking_ ? SlamState::lost : SlamState::initializing;
  }

  void settle(const Pose2& pose) {
    pose_ = pose;
    covariance_ = Eigen::Vector3d(0.01, 0.01, 0.0025).asDiagonal();
    mode_ = Mode::tracking;
    was_tracking_ = true;
    silent_ = lost_scans_ = 0;
  }

  void search(const ScanPoints& scan, const Pose2& step) {
    pose_ = pose_ * step;
    if (const auto found = search_.add(map_, scan, step)) {
      settle(*found);
      track(scan, {});
    }
  }

  /// Search around an approximate pose: correlative search, then the fine match.
  bool search_near(const ScanPoints& scan, double reach, double angle, double min_fraction) {
    if (scan.points.size() < kMinPoints) return false;
    const auto found =
        map_.likelihood.search(thinned(scan.points, 120), {pose_, reach, reach, angle}, {0.4, 1, 0.5, 0.3});
    if (found.empty()) return false;
    const Pose2 near = found.front().T_map_base;
    const Match exact = match(map_.fine, scan.points, near, near, Eigen::Matrix3d::Zero(), match_);
    if (exact.explained < min_fraction) return false;
    settle(exact.T_map_base);
    return true;
  }

  void start(const ScanPoints& scan, const Pose2& step) {
    pose_ = pose_ * step;
    covariance_ =
        Eigen::Vector3d(kStartSigma * kStartSigma, kStartSigma * kStartSigma, kStartYawSigma * kStartYawSigma)
            .asDiagonal();
    if (search_near(scan, 3 * kStartSigma, 3 * kStartYawSigma, kFoundAgain)) return;
    if (++lost_scans_ >= kGiveUpAfter) mode_ = Mode::searching;
  }

  void track(const ScanPoints& scan, const ScanOdometry::Step& step) {
    const double driven = step.step.position().norm(), turned = std::abs(step.step.yaw);
    const Pose2 expected = pose_ * step.step;
    Eigen::Matrix3d moved = odometry_covariance(robot_, driven, turned);
    if (!step.known) moved += Eigen::Vector3d(0.04, 0.04, 0.04).asDiagonal();
    const Eigen::Matrix3d predicted = propagated_covariance(covariance_, pose_, expected, moved);
    const Eigen::Matrix3d prior = predicted.inverse();
    pose_ = expected;
    covariance_ = predicted;
    const Match found = match_from_several(map_.fine, map_.coarse, scan.points, expected, prior, match_);
    if (found.explained >= kMinExplained && scan.points.size() >= kMinPoints) {
      pose_ = found.T_map_base;
      covariance_ = (prior + found.information).inverse();
      silent_ = 0;
    } else {
      ++silent_;
    }
    const double sigma = std::sqrt(std::max(covariance_(0, 0), covariance_(1, 1)));
    if (silent_ >= kPatience || sigma > kLostSigma) mode_ = Mode::lost;
  }

  void recover(const ScanPoints& scan, const ScanOdometry::Step& step) {
    pose_ = pose_ * step.step;
    ++lost_scans_;
    if (lost_scans_ % kRetryEvery == 1 && search_near(scan, 1.5, 0.6, kFoundAgain)) return;
    if (lost_scans_ >= kGiveUpAfter) {
      mode_ = Mode::searching;
      search_.restart();
    }
  }

  RobotDescription robot_;
  FrozenMap map_;
  MatchOptions match_;
  ScanOdometry odometry_;
  AttitudeTrack attitude_;
  GlobalSearch search_;
  Mode mode_ = Mode::searching;
  bool was_tracking_ = false;
  Pose2 pose_;
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Identity();
  int silent_ = 0, lost_scans_ = 0;
};

}  // namespace

Result<std::unique_ptr<Slam>> make_own_localizer(const RobotDescription& robot, const std::string& map_path,
                                                 const SlamOptions& options) {
  auto map = load_frozen_map(map_path, options.resolution);
  if (!map) return map.error();
  return std::unique_ptr<Slam>(std::make_unique<Localizer>(robot, std::move(*map), options));
}

}  // namespace parhelion::pose
