#include "fusion/pose/pose_doubt.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace parhelion::pose {
namespace {

constexpr int kDirections = 360;
constexpr int kNeighbours = 2;         ///< directions: motion within a sweep, errors of yaw
constexpr double kChanged = 0.3;       ///< m
constexpr std::size_t kCompared = 30;  ///< returns
/// Chosen on the generated buildings of localization_test.cpp, and so that the recordings of
/// docs/measurements/localization.md give no false alarm.
constexpr double kMuchChange = 0.4, kAllChanged = 0.7;
/// Of what the map usually explains: people who leave change much, and the map explains more.
constexpr double kAsUsual = 0.8;
constexpr double kGap = 2.5;   ///< usual intervals
constexpr double kMemory = 1;  ///< s
constexpr double kMuchMotion = 0.25,
                 kMuchTurn = 0.25;            ///< m, rad; and the same fraction of odometry's motion
constexpr double kJust = 0.3, kStill = 0.05;  ///< s; m and rad, of odometry in that time
constexpr Duration kDoubted = seconds(1.0);

/// The nearest range in each direction about a laser.
class Around {
 public:
  Around() { nearest_.fill(std::numeric_limits<float>::infinity()); }

  static int direction(const Eigen::Vector2d& arm) {
    const double turns = std::atan2(arm.y(), arm.x()) / (2 * std::numbers::pi);
    return static_cast<int>(std::floor((turns + 1) * kDirections)) % kDirections;
  }
  void add(const Eigen::Vector2d& arm) {
    float& nearest = nearest_[static_cast<std::size_t>(direction(arm))];
    nearest = std::min(nearest, static_cast<float>(arm.norm()));
  }
  /// Of the nearest thing in neighbouring directions; infinite: nothing.
  double nearest(const Eigen::Vector2d& arm) const {
    const int middle = direction(arm) + kDirections;
    float low = std::numeric_limits<float>::infinity();
    for (int i = -kNeighbours; i <= kNeighbours; ++i)
      low = std::min(low, nearest_[static_cast<std::size_t>((middle + i) % kDirections)]);
    return static_cast<double>(low);
  }

 private:
  std::array<float, kDirections> nearest_;
};

struct Seen {
  std::size_t compared = 0, missing = 0;
};

/// The returns of `scan` that `other` would have to see, and does not. `T_other_scan`: of the base.
Seen seen_by(const ScanPoints& other, const ScanPoints& scan, const Pose2& T_other_scan) {
  Around around;
  for (const Eigen::Vector2d& p : other.points) around.add(p - other.laser);
  Seen seen;
  for (const Eigen::Vector2d& p : scan.points) {
    const Eigen::Vector2d arm = T_other_scan * p - other.laser;
    const double nearest = around.nearest(arm), range = arm.norm();
    if (!std::isfinite(nearest)) continue;
    ++seen.compared;
    if (range < nearest - kChanged - 0.02 * range) ++seen.missing;
  }
  return seen;
}

double fraction(const Seen& seen) {
  return static_cast<double>(seen.missing) / static_cast<double>(seen.compared);
}

}  // namespace

ScanChange change_between(const ScanPoints& before, const ScanPoints& now, const Pose2& T_before_now) {
  const Seen appeared = seen_by(before, now, T_before_now);
  const Seen vanished = seen_by(now, before, T_before_now.inverse());
  if (std::min(appeared.compared, vanished.compared) < kCompared) return {};
  return {fraction(vanished), fraction(appeared), true};
}

void PoseDoubt::forget() {
  previous_.reset();
  moved_otherwise_.reset();
  displaced_ = still_ = false;
  unexplained_.setZero();
  interval_ = unexplained_yaw_ = driven_ = turned_ = just_driven_ = 0;
}

void PoseDoubt::add(const ScanPoints& scan, const Pose2& T_map_before, const Pose2& T_map_now,
                    const ScanOdometry::Step& odometry, double of_usual) {
  const double enough = of_usual < kAsUsual ? kMuchChange : kAllChanged;
  const Pose2 step = T_map_before.inverse() * T_map_now, expected = T_map_before * odometry.step;
  const auto much_changed = [&](const Pose2& by) {
    const ScanChange change = change_between(*previous_, scan, by);
    return change.known && change.vanished + change.appeared > enough;
  };
  const double dt = previous_ ? (scan.stamp - previous_->stamp).seconds() : 0;
  // After a gap nobody knows the motion well enough.
  const bool comparable = previous_ && (interval_ == 0 || dt < kGap * interval_);
  displaced_ = comparable && much_changed(step) && much_changed(odometry.step);
  if (previous_) interval_ += (dt - interval_) * (interval_ == 0 ? 1 : 0.1);
  const double kept = std::exp(-std::max(dt, 0.0) / kMemory);
  unexplained_ = kept * unexplained_ + (T_map_now.position() - expected.position());
  unexplained_yaw_ = kept * unexplained_yaw_ + wrap_angle(T_map_now.yaw - expected.yaw);
  driven_ = kept * driven_ + odometry.step.position().norm();
  turned_ = kept * turned_ + std::abs(odometry.step.yaw);
  just_driven_ = std::exp(-std::max(dt, 0.0) / kJust) * just_driven_ + odometry.step.position().norm() +
                 std::abs(odometry.step.yaw);
  still_ = !odometry.known || just_driven_ < kStill;
  if (unexplained_.norm() > kMuchMotion * (1 + driven_) ||
      std::abs(unexplained_yaw_) > kMuchTurn * (1 + turned_))
    moved_otherwise_ = scan.stamp;
  previous_ = scan;
}

bool PoseDoubt::carried() const { return moved_otherwise() && still_; }

bool PoseDoubt::moved_otherwise() const {
  return moved_otherwise_ && previous_ && previous_->stamp - *moved_otherwise_ <= kDoubted;
}

}  // namespace parhelion::pose
