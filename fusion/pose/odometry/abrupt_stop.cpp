#include "fusion/pose/odometry/abrupt_stop.hpp"

#include <cmath>

#include "protocols/pose2.hpp"

namespace parhelion::pose {
namespace {

constexpr double kExactly = 1e-6;                    ///< m and rad
constexpr Duration kBraking = milliseconds(300);     ///< the time in which a stop is judged
constexpr Duration kLongestGap = milliseconds(110);  ///< between samples, for that
constexpr Duration kApart = milliseconds(6);         ///< at least, of samples that are kept
/// m/s^2: Intel's robot brakes with up to 2.9 in its 235 stops. A robot that is slower than 0.48 m/s stops so
/// in any case, and is not noticed.
constexpr double kHard = 3.2;

}  // namespace

void AbruptStop::add(const Odometry& odometry) {
  const Pose2 pose = planar(odometry.T_odom_base);
  if (!pose.finite()) return;
  const bool gap =
      !latest_ || odometry.stamp <= latest_->stamp || odometry.stamp - latest_->stamp > kLongestGap;
  if (gap) {
    moving_.clear();
    if (!still_) stopped_ = false;
  }
  const Pose2 step = latest_ ? planar(latest_->T_odom_base).inverse() * pose : Pose2{};
  const double driven = step.position().norm();
  const bool stands = latest_ && driven < kExactly && std::abs(step.yaw) < kExactly;
  if (stands && !still_) {
    const double hard = deceleration();
    stopped_ = hard > kHard;
    if (stopped_) speed_ = hard * kBraking.seconds() / 2;
    was_true_ = false;
    moving_.clear();
  }
  if (!stands && still_) {
    if (gap)
      stopped_ = was_true_ = false;
    else
      moving_.push(last_);
  }
  still_ = stands;
  latest_ = odometry;
  last_ = {odometry.stamp, last_.driven + driven};
  if (still_) return;
  if (moving_.count() == 0 || last_.stamp - moving_.newest().stamp >= kApart) moving_.push(last_);
  if (stopped_) end_after(last_);
}

/// m/s^2, if it was even, of the last moments before the newest sample; 0 where too little is known.
double AbruptStop::deceleration() const {
  if (moving_.count() == 0) return 0;
  const Sample& last = moving_.newest();
  const std::size_t age = moving_.age_at(last.stamp - kBraking);
  if (age >= moving_.count()) return 0;
  const Sample& first = moving_.newest(age);
  const double seconds = (last.stamp - first.stamp).seconds();
  return 2 * (last.driven - first.driven) / (seconds * kBraking.seconds());
}

/// Odometry moves again.
void AbruptStop::end_after(const Sample& now) {
  const std::size_t age = moving_.age_at(now.stamp - kBraking);
  if (age >= moving_.count()) return;
  const Sample& first = moving_.newest(age);
  const double seconds = (now.stamp - first.stamp).seconds();
  was_true_ = 2 * (now.driven - first.driven) < kHard * seconds * kBraking.seconds();
  stopped_ = false;
}

}  // namespace parhelion::pose
