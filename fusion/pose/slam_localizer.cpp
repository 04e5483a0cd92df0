#include <Eigen/LU>
#include <numbers>

#include "fusion/pose/estimate.hpp"
#include "fusion/pose/maps/frozen_map.hpp"
#include "fusion/pose/matching/weak_directions.hpp"
#include "fusion/pose/odometry/scan_odometry.hpp"
#include "fusion/pose/own_slam.hpp"
#include "fusion/pose/search/localizer_search.hpp"
#include "fusion/pose/search/wide_search.hpp"
#include "fusion/pose/slam.hpp"
#include "fusion/pose/tracking/beam_correction.hpp"
#include "fusion/pose/tracking/held_pose.hpp"
#include "fusion/pose/tracking/pose_doubt.hpp"
#include "fusion/pose/tracking/scan_tracking.hpp"
#include "fusion/pose/tracking/slip_check.hpp"

namespace parhelion::pose {
namespace {

constexpr double kMinExplained = 0.35;  ///< minimum for a valid scan (people may surround the robot)
/// A scan is valid down to this fraction of what the map usually explains.
constexpr double kMinOfUsual = 0.6;
constexpr double kUsualMemory = 0.02;  ///< weight of a scan in that
/// Returns behind mapped surfaces, as a fraction of all: at a right place some doors have opened.
constexpr double kMaxThrough = 0.25;
constexpr double kMinFound = 0.4;  ///< the same near where the robot must be, in a map that explains little
constexpr double kFoundAgain = 0.55;  ///< fraction of explained points that ends the lost state
/// The best place near the expected one counts as found if the second explains fewer points by this fraction.
constexpr double kClearlyBetter = 0.05;
constexpr Duration kUnsureAfter = milliseconds(300),
                   kLostAfter = milliseconds(800);          ///< without a valid scan
constexpr double kUnsureSigma = 0.15, kLostSigma = 0.3;     ///< m
constexpr Duration kRetryEvery = milliseconds(300);         ///< between two searches near the expected pose
constexpr Duration kGiveUpAfter = seconds(2.0);             ///< of those
constexpr double kStartSigma = 0.3, kStartYawSigma = 0.15;  ///< m, rad: uncertainty of `start`
constexpr double kFoundSigma = 0.1, kFoundYawSigma = 0.05;  ///< m, rad: of a place found in the whole map
constexpr std::size_t kMinPoints = 10;
/// m, ScanTracking's limit: along a corridor people and new things may draw scans by metres.
constexpr double kMaxLeap = 0.3;
/// m, 1 sigma, of a step. Chosen on Intel (for true ellipses) and in the ROS map of SENA, where with more the
/// next place that looks alike is taken.
constexpr double kMinOdometryError = 0.005;
/// Odometry's errors since the robot was lost (1 sigma): at first (m, rad), and per m driven. Odometry that
/// is believed has the first, another the second. From kAnywhereSigma (m) on the robot may be anywhere.
struct AwayErrors {
  double position, yaw, per_metre;
};
constexpr AwayErrors kAway{0.1, 0.03, 0.05}, kAwayByBadOdometry{0.15, 0.1, 0.2};
constexpr double kAwayYawPerRadian = 0.05, kAwayYawPerMetre = 0.02, kAnywhereSigma = 0.7;
constexpr double kSigmas = 3;  ///< searched to each side
/// m, rad, 1 sigma, where nothing is known of the motion.
constexpr double kUnknownSigma = 0.5, kUnknownYawSigma = 0.2;
constexpr double kSamePlace = 0.3, kSameYaw = 0.2;  ///< m, rad
/// A lost robot that is this near to where odometry predicts it (m, rad), by points that determine the pose
/// to this sigma (m) and of which the map explains nearly as many as usual, for so long, was never away.
constexpr double kExact = 0.1, kExactYaw = 0.06, kExactSigma = 0.05, kNearlyUsual = 0.85;
constexpr Duration kExactFor = seconds(1.0);

/// Covariance of x, y, yaw; m, rad.
Eigen::Matrix3d diagonal(double sigma, double yaw_sigma) {
  return Eigen::Vector3d(sigma * sigma, sigma * sigma, yaw_sigma * yaw_sigma).asDiagonal();
}

class Localizer final : public Slam {
 public:
  Localizer(const RobotDescription& robot, std::shared_ptr<const FrozenMap> map, const SlamOptions& options)
      : robot_(robot),
        options_(options),
        map_(std::move(map)),
        odometry_(robot.odometry),
        attitude_(robot.imu),
        beam_correction_(*robot.laser, options.doubt_mounting),
        tracking_(robot, {kMaxLeap, kMinOdometryError}),
        held_(robot, {}) {
    match_.range_sigma = map_->sigma;
    match_.by_direction = true;
    if (!options.start) return;
    pose_ = {options.start->x(), options.start->y(), options.start->z()};
    mode_ = Mode::starting;
  }

  void add(const Odometry& odometry) override { tracking_.add(odometry_.add(odometry)); }
  void add_inertial(const ImuSample& sample) override { attitude_.add(sample); }

  std::optional<PoseEstimate> add(const Scan& scan) override {
    const auto attitude = attitude_.at(scan.stamp);
    const auto step = odometry_.step_to(scan, *robot_.laser, attitude);
    if (!step) return std::nullopt;
    beam_correction_.learn(scan, *step, tracking_, *robot_.laser);
    const SweepMotion motion = sweep_motion(options_, tracking_, scan.stamp, step->sweep);
    const ScanPoints points = deskewed(scan, *robot_.laser, motion, attitude);
    now_ = scan.stamp;
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
    PoseEstimate estimate = planar_estimate(scan.stamp, pose_, published(), state());
    estimate.map_id = map_->grid.id;
    return estimate;
  }

  std::vector<PoseEstimate> finish() override { return {}; }
  std::vector<OdometryFinding> odometry_findings() const override {
    return beam_correction_.among(tracking_.findings());
  }
  GridMap grid_map() const override { return map_->grid; }
  Status save_simplemap(const std::string& path) const override {
    return Error{path + ": localization does not build a map; omit --map to build one"};
  }

 private:
  enum class Mode { searching, starting, tracking, lost };

  SlamState state() const {
    if (mode_ == Mode::tracking) return is_doubtful() ? SlamState::unsure : SlamState::tracking;
    return mode_ == Mode::lost || was_tracking_ ? SlamState::lost : SlamState::initializing;
  }

  /// Its robot drives on like one on wheels. Before that is known, it may as well be carried.
  bool has_frozen_odometry() const { return tracking_.fault() == OdometryFault::frozen; }

  bool is_doubtful() const {
    const OdometryFault fault = tracking_.fault();
    if (fault == OdometryFault::laser_frozen || fault == OdometryFault::carried) return true;
    // Mirrored scans would not fit the map.
    if (options_.doubt_mounting && fault != OdometryFault::rotation_reversed &&
        tracking_.is_mounting_doubtful())
      return true;
    if (suspicious_ || slipped_ || (fault == OdometryFault::none && doubt_.moved_otherwise())) return true;
    return now_ - matched_ > kUnsureAfter || sigma() > kUnsureSigma;
  }

  /// With the errors that the map's surfaces have in common, which no number of scans removes.
  Eigen::Matrix3d published() const {
    Eigen::Matrix3d covariance = tracking_.published(covariance_);
    covariance.topLeftCorner<2, 2>().diagonal().array() += map_->bias * map_->bias;
    return covariance;
  }

  double sigma() const { return std::sqrt(std::max(covariance_(0, 0), covariance_(1, 1))); }

  void settle(const Pose2& pose) { settle({pose, diagonal(kFoundSigma, kFoundYawSigma)}); }

  void settle(const Estimate2& found) {
    tracking_.forget();
    doubt_.forget();
    slip_.forget();
    search_.restart();
    pose_ = found.T_map_base;
    covariance_ = found.covariance;
    mode_ = Mode::tracking;
    was_tracking_ = true;
    matched_ = now_;
    lost_since_.reset();
    suspicious_ = slipped_ = false;
    usual_ = kFoundAgain;
    matches_ = 0;
  }

  void search(const ScanPoints& scan, const Pose2& step) {
    pose_ = pose_ * step;
    if (const auto found = search_.add(*map_, scan, step)) {
      settle(*found);
      track(scan, {});
    }
  }

  /// Search around an approximate pose with these errors (1 sigma, m and rad): correlative search, then the
  /// fine match of the best places. Fails where the best one explains less than `enough`, or a second one
  /// about as much, by less than `lead`.
  bool search_near(const ScanPoints& scan, double sigma, double yaw_sigma, double lead, double enough) {
    if (scan.points.size() < kMinPoints) return false;
    const Eigen::Matrix3d covariance = diagonal(sigma, yaw_sigma), prior = covariance.inverse();
    const WideSearchOptions wide{
        kSigmas * sigma, kSigmas * yaw_sigma, 0.4, enough, lead, enough, lead, prior};
    const auto found = wide_search(map_->likelihood, map_->fine, scan.points, pose_, wide, match_);
    if (!found) return false;
    const Pose2 T_map_base = found->T_map_base;
    if ((T_map_base.position() - pose_.position()).norm() > std::numbers::sqrt2 * wide.reach) return false;
    if (!is_possible(scan, T_map_base)) return false;
    // What is new along a corridor may draw the first scan.
    settle(joined({pose_, covariance}, prior, T_map_base, found->information, new_fraction({})));
    return true;
  }

  /// Since the pose is being searched for near where it is expected. True: for too long.
  bool give_up() {
    if (!lost_since_) lost_since_ = now_;
    return now_ - *lost_since_ >= kGiveUpAfter;
  }

  void start(const ScanPoints& scan, const Pose2& step) {
    pose_ = pose_ * step;
    covariance_ = diagonal(kStartSigma, kStartYawSigma);
    if (search_near(scan, kStartSigma, kStartYawSigma, 0, kFoundAgain)) return;
    if (give_up()) mode_ = Mode::searching;
  }

  /// Few returns lie behind mapped surfaces.
  bool is_possible(const ScanPoints& scan, const Pose2& T_map_base) {
    beams_.clear();
    const std::size_t count = std::min<std::size_t>(scan.points.size(), 90);
    for (std::size_t i = 0; i < count; ++i)
      beams_.push_back({scan.laser, scan.points[i * scan.points.size() / count]});
    explained_.assign(*map_, beams_, T_map_base);
    return explained_.through() <= kMaxThrough;
  }

  void track(const ScanPoints& scan, const ScanOdometry::Step& step) {
    const Pose2 before = pose_;
    const auto found =
        tracking_.follow({map_->fine, map_->coarse, {}}, scan, {pose_, covariance_}, step, match_);
    const double enough = std::max(kMinExplained, kMinOfUsual * usual_);
    if (found.match.explained >= enough && scan.points.size() >= kMinPoints &&
        is_possible(scan, found.match.T_map_base)) {
      take(found, step.step);
      matched_ = now_;
      usual_ += std::max(kUsualMemory, 1.0 / ++matches_) * (found.match.explained - usual_);
    } else {
      pose_ = found.expected.T_map_base;
      covariance_ = found.expected.covariance;
    }
    doubt_.add(scan, before, pose_, step, found.match.explained / usual_);
    suspicious_ |= doubt_.carried() && !has_frozen_odometry();
    if (doubt_.displaced()) {
      lose(true);
    } else if (now_ - matched_ > kLostAfter || sigma() > kLostSigma) {
      lose(suspicious_);
    } else {
      const bool slipped = slip_.add(*map_, scan, pose_, found.match.explained, usual_, match_);
      if (slipped && !slipped_ && !suspicious_) search_.restart(usual_);
      slipped_ = slipped;
      if (suspicious_ || slipped_) verify(scan, step.step);
    }
  }

  void take(const ScanTracking::Followed& found, const Pose2& step) {
    const Estimate2 now = held_.after({pose_, covariance_}, found, step);
    pose_ = now.T_map_base;
    covariance_ = now.covariance;
  }

  /// The robot moves while its wheels stand (it is carried, or odometry has failed), or another place
  /// explains its scans much better. The pose is doubted until the whole map has been searched.
  void verify(const ScanPoints& scan, const Pose2& step) {
    const auto found = search_.add(*map_, scan, step);
    if (!found || (doubt_.carried() && !has_frozen_odometry())) return;
    const Pose2 apart = pose_.inverse() * *found;
    if (apart.position().norm() > kSamePlace || std::abs(apart.yaw) > kSameYaw) pose_ = *found;
    settle(pose_);
  }

  /// `displaced`: the robot may be anywhere now. Otherwise it is searched for near the expected pose first.
  void lose(bool displaced) {
    mode_ = Mode::lost;
    displaced_ = displaced;
    picked_up_ = suspicious_;
    tried_.reset();
    exact_since_.reset();
    lost_since_.reset();
    search_.restart(usual_);
    const AwayErrors& errors = held_.is_odometry_good() ? kAway : kAwayByBadOdometry;
    away_ = {errors.position, errors.yaw};
  }

  /// The robot is exactly where odometry predicts it, and has been for a while: only something in front of
  /// the laser had come or gone. A robot that was carried away is not put down with this accuracy.
  bool is_undisturbed(const ScanPoints& scan) {
    const Match found = match(map_->fine, scan.points, pose_, pose_, Eigen::Matrix3d::Zero(), match_);
    const Pose2 off = pose_.inverse() * found.T_map_base;
    const Eigen::Matrix3d covariance = (found.information + 1e-3 * Eigen::Matrix3d::Identity()).inverse();
    const bool exact = off.position().norm() < kExact && std::abs(off.yaw) < kExactYaw &&
                       covariance.topLeftCorner<2, 2>().trace() < kExactSigma * kExactSigma &&
                       found.explained >= std::max(kMinFound, kNearlyUsual * usual_) &&
                       is_possible(scan, found.T_map_base) && !doubt_.moved_otherwise();
    if (!exact) exact_since_.reset();
    if (exact && !exact_since_) exact_since_ = now_;
    if (exact) pose_ = found.T_map_base;
    return exact && now_ - *exact_since_ >= kExactFor;
  }

  /// Of a lost robot whose odometry has been good since.
  std::optional<Vicinity> vicinity() const {
    if (picked_up_ || away_.sigma > kAnywhereSigma) return std::nullopt;
    return Vicinity{pose_, kSigmas * away_.sigma, kSigmas * away_.yaw_sigma};
  }

  void recover(const ScanPoints& scan, const ScanOdometry::Step& step) {
    const Pose2 before = pose_;
    pose_ = pose_ * step.step;
    doubt_.add(scan, before, pose_, step, 0);
    const AwayErrors& errors = held_.is_odometry_good() ? kAway : kAwayByBadOdometry;
    const double driven = step.step.position().norm();
    away_.sigma += errors.per_metre * driven;
    away_.yaw_sigma += kAwayYawPerRadian * std::abs(step.step.yaw) + kAwayYawPerMetre * driven;
    const bool unknown =  // where odometry cannot be believed
        !step.known || tracking_.fault() != OdometryFault::none || doubt_.moved_otherwise();
    displaced_ |=
        doubt_.displaced() || doubt_.carried() || away_.sigma > kAnywhereSigma || (give_up() && unknown);
    picked_up_ |= unknown || doubt_.carried();
    if (is_undisturbed(scan)) {
      settle(pose_);
      track(scan, {});
      return;
    }
    if (displaced_) {
      if (const auto found = search_.add(*map_, scan, step.step, vicinity())) {
        settle(*found);
        track(scan, {});
      }
      return;
    }
    if (tried_ && now_ - *tried_ < kRetryEvery) return;
    tried_ = now_;
    const double enough = std::max(kMinFound, kNearlyUsual * usual_);
    search_near(scan, unknown ? kUnknownSigma : away_.sigma, unknown ? kUnknownYawSigma : away_.yaw_sigma,
                kClearlyBetter, enough);
  }

  /// 1 sigma of the pose that odometry predicts, since the robot was lost; m, rad.
  struct Away {
    double sigma = 0, yaw_sigma = 0;
  };

  RobotDescription robot_;
  SlamOptions options_;
  std::shared_ptr<const FrozenMap> map_;
  MatchOptions match_;
  ScanOdometry odometry_;
  AttitudeTrack attitude_;
  BeamCorrection beam_correction_;
  ScanTracking tracking_;
  HeldPose held_;
  PoseDoubt doubt_;
  SlipCheck slip_;
  GlobalSearch search_;
  Away away_;
  Mode mode_ = Mode::searching;
  bool was_tracking_ = false, displaced_ = false, suspicious_ = false, slipped_ = false;
  bool picked_up_ = false;  ///< perhaps, since the robot was lost
  Pose2 pose_;
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Identity();
  SensorTime now_, matched_;  ///< stamps of this scan, and of the last one that the map explained
  std::optional<SensorTime> lost_since_, tried_, exact_since_;
  int matches_ = 0;             ///< since the pose was found
  double usual_ = kFoundAgain;  ///< fraction of points that the map explains
  std::vector<SeenBeam> beams_;
  ExplainedBeams explained_;
};

}  // namespace

std::unique_ptr<Slam> make_own_localizer(const RobotDescription& robot, std::shared_ptr<const FrozenMap> map,
                                         const SlamOptions& options) {
  return std::make_unique<Localizer>(robot, std::move(map), options);
}

Result<std::unique_ptr<Slam>> make_own_localizer(const RobotDescription& robot, const std::string& map_path,
                                                 const SlamOptions& options) {
  auto map = load_frozen_map(map_path, options.resolution);
  if (!map) return map.error();
  return make_own_localizer(robot, std::make_shared<const FrozenMap>(std::move(*map)), options);
}

}  // namespace parhelion::pose
