#include "fusion/pose/estimate.hpp"
#include "fusion/pose/mapping/keyframe_search.hpp"
#include "fusion/pose/mapping/live_loops.hpp"
#include "fusion/pose/mapping/loop_closing.hpp"
#include "fusion/pose/mapping/slam_front_end.hpp"
#include "fusion/pose/odometry/scan_odometry.hpp"
#include "fusion/pose/own_slam.hpp"
#include "fusion/pose/slam.hpp"
#include "fusion/pose/tracking/beam_correction.hpp"

namespace parhelion::pose {
namespace {

class Mapper final : public Slam {
 public:
  Mapper(const RobotDescription& robot, const SlamOptions& options)
      : robot_(robot),
        options_(options),
        odometry_(robot.odometry, options.has_odometry),
        attitude_(robot.imu),
        beam_correction_(*robot.laser, options.doubt_mounting),
        front_end_(robot, {.doubt_mounting = options.doubt_mounting, .has_odometry = options.has_odometry}) {
    if (options.start) front_end_.set_start({options.start->x(), options.start->y(), options.start->z()});
  }

  void add(const Odometry& odometry) override { front_end_.add(odometry_.add(odometry)); }
  void add_inertial(const ImuSample& sample) override { attitude_.add(sample); }

  std::optional<PoseEstimate> add(const Scan& scan) override {
    const auto attitude = attitude_.at(scan.stamp);
    const auto step = odometry_.step_to(scan, *robot_.laser, attitude);
    if (!step) return std::nullopt;
    beam_correction_.learn(scan, *step, front_end_.tracking(), *robot_.laser);
    const SweepMotion motion = sweep_motion(options_, front_end_.tracking(), scan.stamp, step->sweep);
    const ScanPoints points = deskewed(scan, *robot_.laser, motion, attitude);
    SlamFrontEnd::Estimate tracked = front_end_.add(points, *step);
    if (!options_.has_odometry)
      by_scans_ = {scan.stamp, transform<Odom, Base>(planar(by_scans_.T_odom_base) * tracked.moved)};
    if (const auto found = find_again(points, *step)) tracked.T_map_base = *found;
    if (front_end_.keyframes().empty()) return std::nullopt;  // only empty scans yet
    const Pose2 T_keyframe_base = front_end_.keyframes().back().T_map_base.inverse() * tracked.T_map_base;
    if (const auto first = front_end_.take_bent()) loops_.poses_changed(front_end_.keyframes(), *first);
    if (const auto corrected = loops_.update(front_end_.keyframes(), scan.stamp))
      front_end_.correct(*corrected);
    PoseEstimate estimate =
        planar_estimate(scan.stamp, front_end_.keyframes().back().T_map_base * T_keyframe_base,
                        tracked.covariance, tracked.state);
    tracked_.push_back({estimate, front_end_.keyframes().size() - 1, T_keyframe_base});
    finished_ = false;
    return estimate;
  }

  std::vector<PoseEstimate> finish() override {
    close_loops();
    const std::vector<Keyframe>& keyframes = front_end_.keyframes();
    const std::string id = grid_map().id;
    std::vector<PoseEstimate> trajectory;
    const std::size_t first = keyframes.empty() ? 0 : keyframes.front().scan_index;
    for (std::size_t i = 0; i < tracked_.size(); ++i) {
      PoseEstimate estimate = tracked_[i].estimate;
      estimate.T_map_base = transform<Map, Base>(final_pose_of(tracked_[i], first + i));
      estimate.causal = false;
      estimate.map_id = id;
      trajectory.push_back(std::move(estimate));
    }
    return trajectory;
  }

  std::vector<OdometryFinding> odometry_findings() const override {
    return beam_correction_.among(front_end_.tracking().findings());
  }

  std::optional<ClockOffset> odometry_offset() const override {
    constexpr double kKnown = 0.05;  // s: half of what is thought of any robot
    const ClockOffset offset{front_end_.scale().time_offset(), front_end_.scale().time_offset_sigma()};
    return offset.sigma < kKnown ? std::optional(offset) : std::nullopt;
  }

  std::optional<Odometry> odometry_by_scans() const override {
    return options_.has_odometry || tracked_.empty() ? std::nullopt : std::optional(by_scans_);
  }

  GridMap grid_map() const override {
    if (!grid_) grid_ = grid_of(mapped_scans(), options_.resolution);
    return *grid_;
  }

  Status save_simplemap(const std::string& path) const override {
    return write_simplemap(mapped_scans(), path);
  }

 private:
  /// A causal estimate, and where it is from the last keyframe.
  struct Tracked {
    PoseEstimate estimate;
    std::size_t keyframe = 0;
    Pose2 T_keyframe_base;
  };

  /// Where a robot that was picked up has been put down, in the map so far.
  std::optional<Pose2> find_again(const ScanPoints& scan, const ScanOdometry::Step& step) {
    if (!front_end_.is_displaced()) {
      search_.forget();
      return std::nullopt;
    }
    const auto found =
        search_.add(front_end_.keyframes(), *robot_.laser, scan, step.step, front_end_.usually_explained());
    if (found) front_end_.found(*found, scan);
    return found;
  }

  void close_loops() {
    if (finished_) return;
    LoopClosingOptions options;
    options.odometry_scale = front_end_.scale().scale();
    // A fault changes the scale on the way.
    options.odometry_weight = front_end_.tracking().findings().empty() ? front_end_.scale().weight() : 0;
    final_ = closed_loops(front_end_.keyframes(), options, options_.progress);
    grid_.reset();
    finished_ = true;
  }

  const Pose2& final_pose(std::size_t k) const {
    return finished_ ? final_[k] : front_end_.keyframes()[k].T_map_base;
  }

  /// Between two keyframes the correction is interpolated.
  Pose2 final_pose_of(const Tracked& tracked, std::size_t scan) const {
    const std::vector<Keyframe>& keyframes = front_end_.keyframes();
    const std::size_t k = tracked.keyframe;
    const Pose2 by_last = final_pose(k) * tracked.T_keyframe_base;
    if (k + 1 >= keyframes.size()) return by_last;
    const Pose2 by_next = final_pose(k + 1) * (keyframes[k + 1].step.inverse() * tracked.T_keyframe_base);
    const double s = static_cast<double>(scan - keyframes[k].scan_index) /
                     static_cast<double>(keyframes[k + 1].scan_index - keyframes[k].scan_index);
    return interpolate(by_last, by_next, s);
  }

  std::vector<MappedScan> mapped_scans() const {
    std::vector<MappedScan> scans;
    for (std::size_t k = 0; k < front_end_.keyframes().size(); ++k)
      scans.push_back(mapped(front_end_.keyframes()[k], final_pose(k), *robot_.laser));
    return scans;
  }

  RobotDescription robot_;
  SlamOptions options_;
  ScanOdometry odometry_;
  AttitudeTrack attitude_;
  BeamCorrection beam_correction_;
  SlamFrontEnd front_end_;
  Odometry by_scans_;  ///< at the last scan
  LiveLoops loops_;
  KeyframeSearch search_;
  std::vector<Tracked> tracked_;
  std::vector<Pose2> final_;
  bool finished_ = false;
  mutable std::optional<GridMap> grid_;
};

}  // namespace

Result<std::unique_ptr<Slam>> make_own_mapper(const RobotDescription& robot, const SlamOptions& options) {
  return std::unique_ptr<Slam>(std::make_unique<Mapper>(robot, options));
}

}  // namespace parhelion::pose
