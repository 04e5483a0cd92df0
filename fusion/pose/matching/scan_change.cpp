#include "fusion/pose/matching/scan_change.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace parhelion::pose {
namespace {

constexpr int kDirections = 360;
constexpr int kNeighbours = 2;         ///< directions: motion within a sweep, errors of yaw
constexpr double kChanged = 0.3;       ///< m
constexpr std::size_t kCompared = 30;  ///< returns
constexpr double kGap = 2.5;           ///< usual intervals

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

void PreviousScan::set(const ScanPoints& scan) {
  if (const double dt = seconds_until(scan.stamp); scan_)
    interval_ += (dt - interval_) * (interval_ == 0 ? 1 : 0.1);
  scan_ = scan;
}

void PreviousScan::forget() {
  scan_.reset();
  interval_ = 0;
}

double PreviousScan::seconds_until(SensorTime now) const {
  return scan_ ? (now - scan_->stamp).seconds() : 0;
}

const ScanPoints* PreviousScan::comparable(SensorTime now) const {
  const double dt = seconds_until(now);
  return scan_ && dt >= 0 && (interval_ == 0 || dt < kGap * interval_) ? &*scan_ : nullptr;
}

}  // namespace parhelion::pose
