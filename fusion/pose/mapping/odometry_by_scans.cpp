#include "fusion/pose/mapping/odometry_by_scans.hpp"

#include "fusion/pose/matching/scan_points.hpp"

namespace parhelion::pose {
namespace {

constexpr double kWindow = 10;           ///< m of path that scans are matched to
constexpr std::size_t kKeyframes = 200;  ///< after which a new map is begun
constexpr int kScansUntilMotionIsKnown = 10;

}  // namespace

OdometryByScans::OdometryByScans(const RobotDescription& robot)
    : robot_(robot), attitude_(robot.imu), now_(begin()) {}

OdometryByScans::Track OdometryByScans::begin() const {
  SlamFrontEnd::Options options;
  options.window = kWindow;
  options.doubt_mounting = false;
  options.has_odometry = false;
  Track track{std::make_unique<SlamFrontEnd>(robot_, options), 0};
  track.front_end->set_start(T_odom_base_);
  return track;
}

SlamFrontEnd::Estimate OdometryByScans::follow(Track& track, const Scan& scan) const {
  const Twist2 twist = track.front_end->tracking().twist_at({});
  ScanOdometry::Step unknown;
  unknown.known = false;
  ++track.scans;
  return track.front_end->add(deskewed(scan, *robot_.laser, SweepMotion(twist), attitude_.at(scan.stamp)),
                              unknown);
}

/// The new map begins where the old one has the robot, and is used once it knows how the robot moves.
void OdometryByScans::renew(const Scan& scan) {
  if (next_) {
    follow(*next_, scan);
    if (next_->scans < kScansUntilMotionIsKnown || next_->front_end->keyframes().empty()) return;
    now_ = std::move(*next_);
    next_.reset();
  } else if (now_.front_end->keyframes().size() >= kKeyframes) {
    next_ = begin();
    follow(*next_, scan);
  }
}

std::optional<Odometry> OdometryByScans::add(const Scan& scan) {
  const SlamFrontEnd::Estimate estimate = follow(now_, scan);
  if (now_.front_end->keyframes().empty()) return std::nullopt;
  if (estimate.state == SlamState::lost) {
    next_.reset();
    now_ = begin();
    follow(now_, scan);
  } else {
    T_odom_base_ = T_odom_base_ * estimate.moved;
    renew(scan);
  }
  return Odometry{scan.stamp, transform<Odom, Base>(T_odom_base_)};
}

}  // namespace parhelion::pose
