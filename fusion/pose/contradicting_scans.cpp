#include "fusion/pose/contradicting_scans.hpp"

#include <cmath>

namespace parhelion::pose {
namespace {

/// Of the returns that can be compared. Chosen on a robot that rocks by up to 18 degrees (ramp_test.cpp).
constexpr double kMuchChange = 0.4, kLittleChange = 0.2;
constexpr double kAsUsual = 0.85;  ///< of the explained fraction
constexpr double kMemory = 0.03;   ///< weight of a scan in that
/// m, rad, and per m driven while scans contradict each other: from what is expected.
constexpr double kNear = 0.15, kNearYaw = 0.2, kNearPerMetre = 0.1;
/// s: in a longer time people who pass change much. Chosen on fr-clinic, where scans are 0.7 s apart.
constexpr double kSoon = 0.5;
/// m: so far floor that moves along with the robot must have moved to be told from a wall.
constexpr double kSettledDriven = 0.8;
constexpr Duration kSettled = seconds(1.0), kRecent = seconds(10.0), kLongest = seconds(10.0);
/// Of the scans of the last second: between two that are kept, and from the one that is compared to now.
constexpr Duration kKeptEvery = milliseconds(150), kShortest = milliseconds(700), kSecond = seconds(1.0);

}  // namespace

void ContradictingScans::learn(double explained) {
  usual_ += (usual_ == 0 ? 1 : kMemory) * (explained - usual_);
}

bool ContradictingScans::in_doubt(SensorTime now) const {
  return now < tolerated_until_ || (began_before_ && now >= *began_ && now - *began_before_ < kRecent);
}

void ContradictingScans::forget() {
  previous_.forget();
  past_.clear();
  last_.reset();
  tolerated_until_ = {};
  changed_ = false;
}

ContradictingScans::Finding ContradictingScans::contradicting(const ScanPoints& scan) {
  if (!last_) {
    began_before_ = began_;
    began_ = scan.stamp;
  }
  last_ = scan;
  T_last_now_ = {};
  return Finding::contradicting;
}

ContradictingScans::Finding ContradictingScans::contradiction_goes_on(const ScanPoints& scan, bool much) {
  if (much) return contradicting(scan);
  if (scan.stamp - last_->stamp < kSettled || T_last_now_.position().norm() < kSettledDriven)
    return Finding::contradicting;
  if (change_between(*last_, scan, T_last_now_).exceeds(kLittleChange)) return contradicting(scan);
  last_.reset();
  return Finding::settled;
}

/// Keeps the previous scan, if the last one that is kept is old enough.
void ContradictingScans::keep_previous(SensorTime now, const Pose2& T_map_before) {
  const std::optional<ScanPoints>& before = previous_.scan();
  if (before && (past_.empty() || before->stamp - past_.back().scan.stamp >= kKeptEvery))
    past_.push_back({*before, T_odom_base_, T_map_before});
  while (!past_.empty() && now - past_.front().scan.stamp > kSecond) past_.pop_front();
}

ContradictingScans::Finding ContradictingScans::add(const ScanPoints& scan, const Pose2& T_map_before,
                                                    const Pose2& step,
                                                    const std::function<ScanTracking::Followed()>& match) {
  const double dt = previous_.seconds_until(scan.stamp);
  if (dt < 0) forget();
  const ScanPoints* before = dt < kSoon ? previous_.comparable(scan.stamp) : nullptr;
  if (before == nullptr)
    past_.clear();
  else
    keep_previous(scan.stamp, T_map_before);
  T_odom_base_ = T_odom_base_ * step;
  T_last_now_ = T_last_now_ * step;
  driven_ = last_ ? driven_ + step.position().norm() : 0;
  if (last_ && scan.stamp - *began_ > kLongest) {
    last_.reset();
    tolerated_until_ = scan.stamp + kLongest;
  }
  Finding finding = Finding::none;
  if (scan.stamp >= tolerated_until_) finding = compare(before, scan, T_map_before, step, match);
  changed_ = finding == Finding::changed;
  previous_.set(scan);
  return finding;
}

ContradictingScans::Finding ContradictingScans::compare(
    const ScanPoints* before, const ScanPoints& scan, const Pose2& T_map_before, const Pose2& step,
    const std::function<ScanTracking::Followed()>& match) {
  const Past* past =
      past_.empty() || scan.stamp - past_.front().scan.stamp < kShortest ? nullptr : &past_.front();
  const bool much = before != nullptr && change_between(*before, scan, step).exceeds(kMuchChange);
  const bool slowly =
      past != nullptr &&
      change_between(past->scan, scan, past->T_odom_base.inverse() * T_odom_base_).exceeds(kMuchChange);
  if (!much && !slowly && !last_) return Finding::none;
  const ScanTracking::Followed found = match();
  const Pose2 T_map_base = found.match.T_map_base, off = found.expected.T_map_base.inverse() * T_map_base;
  if (slowly &&
      (last_ ||
       change_between(past->scan, scan, past->T_map_base.inverse() * T_map_base).exceeds(kMuchChange)))
    return contradicting(scan);
  const bool near = off.position().norm() < kNear + kNearPerMetre * driven_ && std::abs(off.yaw) < kNearYaw;
  if (near && found.match.explained >= kAsUsual * usual_) {
    last_.reset();
    return Finding::none;
  }
  if (last_) return contradiction_goes_on(scan, much);
  if (!much || !change_between(*before, scan, T_map_before.inverse() * T_map_base).exceeds(kMuchChange))
    return Finding::none;
  return changed_ ? contradicting(scan) : Finding::changed;
}

}  // namespace parhelion::pose
