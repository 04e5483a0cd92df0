#include "fusion/pose/tracks/odometry_track.hpp"

namespace parhelion::pose {
namespace {

/// Two seconds at 1 kHz: faster odometry shortens the history.
constexpr std::size_t kOdometrySlots = 2048;
/// Minimum span over which a twist is computed, so that the quantisation of fast odometry does not become
/// velocity.
constexpr Duration kTwistSpan = milliseconds(40);

}  // namespace

OdometryTrack::OdometryTrack(Duration history, Duration max_extrapolation)
    : history_(history),
      max_extrapolation_(max_extrapolation),
      twist_span_(kTwistSpan),
      samples_(kOdometrySlots) {}

OdometryTrack::Added OdometryTrack::add(const Odometry& odometry) {
  Sample sample{odometry.stamp, planar(odometry.T_odom_base)};
  if (!sample.T_odom_base.finite()) return Added::rejected;
  Added added = Added::accepted;
  if (samples_.count() > 0) {
    const Sample& last = samples_.newest();
    if (sample.stamp <= last.stamp) {
      if (last.stamp - sample.stamp <= history_) return Added::rejected;
      samples_.clear();
      added = Added::restarted;
    } else {
      const Pose2 step = last.T_odom_base.inverse() * sample.T_odom_base;
      sample.driven = last.driven + step.position().norm();
      sample.turned = last.turned + std::abs(step.yaw);
    }
  }
  samples_.push(sample);
  return added;
}

Twist2 OdometryTrack::twist_ending_at(std::size_t age) const {
  const Sample& end = samples_.newest(age);
  std::size_t start = age + 1;
  if (start >= samples_.count()) return {};
  while (start + 1 < samples_.count() && end.stamp - samples_.newest(start).stamp < twist_span_ &&
         end.stamp - samples_.newest(start + 1).stamp <= max_extrapolation_) {
    ++start;
  }
  const Sample& first = samples_.newest(start);
  if (end.stamp - first.stamp > max_extrapolation_ + max_extrapolation_) return {};
  return twist_between(first.T_odom_base, end.T_odom_base, (end.stamp - first.stamp).seconds());
}

std::optional<OdometryAtInstant> OdometryTrack::at(SensorTime t, Missing* missing) const {
  const auto none = [missing](Missing why) {
    if (missing != nullptr) *missing = why;
    return std::nullopt;
  };
  const std::size_t age = samples_.age_at(t);
  if (samples_.count() > 0 && t < samples_.newest().stamp - history_)
    return none(Missing::older_than_history);
  if (age == samples_.count()) return none(Missing::none_there);
  const Sample& before = samples_.newest(age);
  if (age == 0) {
    if (t - before.stamp > max_extrapolation_) return none(Missing::too_far_ahead);
    OdometryAtInstant odometry{before.T_odom_base, before.driven, before.turned, (t - before.stamp).seconds(),
                               twist_ending_at(0)};
    const Pose2 step = moved(odometry.twist, odometry.ahead);
    odometry.T_odom_base = before.T_odom_base * step;
    odometry.driven += step.position().norm();
    odometry.turned += std::abs(step.yaw);
    return odometry;
  }
  const Sample& after = samples_.newest(age - 1);
  // In the middle of a gap the motion is unknown.
  if (t - before.stamp > max_extrapolation_ && after.stamp - t > max_extrapolation_)
    return none(Missing::none_there);
  const double s = (t - before.stamp).seconds() / (after.stamp - before.stamp).seconds();
  return OdometryAtInstant{interpolate(before.T_odom_base, after.T_odom_base, s),
                           before.driven + s * (after.driven - before.driven),
                           before.turned + s * (after.turned - before.turned), 0, twist_ending_at(age - 1)};
}

}  // namespace parhelion::pose
