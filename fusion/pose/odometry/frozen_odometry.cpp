#include "fusion/pose/odometry/frozen_odometry.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::pose {
namespace {

constexpr double kExactly = 1e-6;  ///< m and rad: encoders that stand give the same pose again
/// rad: in all, and from one scan to the next in half of them, as a robot does that has never stood. Scans of
/// a robot that stands turn by less than 0.001. Chosen on the Intel drive.
constexpr double kTurned = 0.025, kTurning = 0.002;
constexpr double kFewest = 3;   ///< intervals: scans of a robot that brakes may still turn
constexpr double kLongest = 3;  ///< s: a robot that has stood for longer is turned by somebody
constexpr double kCertain = 1;  ///< s
constexpr double kSigma = 0.03, kSigmaPerInterval = 0.02;  ///< m

}  // namespace

void FrozenOdometry::add(const Pose2& step, const Motion& before, double intervals) {
  if (step.position().norm() > kExactly || std::abs(step.yaw) > kExactly)
    still_.reset();
  else if (!still_)
    still_ = Still{.before = before};
  if (still_) still_->intervals += intervals;
}

bool FrozenOdometry::add_match(double yaw) {
  if (!still_ || (!still_->frozen && still_->intervals * still_->before.interval > kLongest)) return false;
  const double turn = wrap_angle(yaw - still_->before.T_map_base.yaw);
  if (still_->matches++ == 0) still_->lowest = still_->highest = still_->turn = turn;
  still_->lowest = std::min(still_->lowest, turn);
  still_->highest = std::max(still_->highest, turn);
  still_->turning += std::abs(turn - still_->turn) > kTurning ? 1 : 0;
  still_->turn = turn;
  const bool shows = still_->intervals > kFewest && still_->highest - still_->lowest > kTurned &&
                     2 * still_->turning >= still_->matches;
  if (still_->frozen || !shows) return false;
  still_->frozen = true;
  still_->frozen_at = still_->intervals;
  still_->lowest = still_->highest = turn;
  return true;
}

bool FrozenOdometry::is_certain() const {
  return is_frozen() && (still_->intervals - still_->frozen_at) * still_->before.interval > kCertain &&
         still_->highest - still_->lowest > kTurned;
}

Pose2 FrozenOdometry::driven_on() const {
  return still_->before.T_map_base * moved(twist_to(still_->before.step), still_->intervals);
}

double FrozenOdometry::sigma() const { return kSigma + kSigmaPerInterval * still_->intervals; }

}  // namespace parhelion::pose
