#include "fusion/people/track.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

namespace parhelion::people {
namespace {

constexpr double kAcceleration = 0.8;    // m^2/s^3, spectral density: starts, stops and turns of a walker
constexpr double kStartSpeed = 0.9;      // m/s, 1 sigma
constexpr double kAveraging = 0.5;       // s
constexpr double kMeanPeriod = 3;        // s
constexpr double kMemoryOfMotion = 30;   // s
constexpr double kPlaceAveraging = 1.0;  // s
constexpr double kPartAveraging = 0.3, kFormerAveraging = 4;  // s
constexpr double kMaxShift = 0.3;                             // m
constexpr double kStay = 0.4;                                 // m
constexpr double kMaxSpeed = 3.0;                             // m/s: more is a wrong association

void average(float& mean, double value, double dt, double period = kAveraging) {
  mean += static_cast<float>((value - double{mean}) * std::min(dt / (period + dt), 1.0));
}

float& at(TrackFeatures& features, TrackFeature which) { return features[static_cast<std::size_t>(which)]; }

/// Mean over the track, or over about its last three seconds.
void mean(Track& track, TrackFeature which, double value, double dt) {
  const double share = std::max(1.0 / std::max(track.scans, 1U), dt / (kMeanPeriod + dt));
  float& now = at(track.features, which);
  now += static_cast<float>((value - double{now}) * std::min(share, 1.0));
}

void observe_shape(Track& track, const TrackObservation& seen, double dt) {
  using F = TrackFeature;
  using S = SegmentFeature;
  if (seen.shape == nullptr) return;
  for (const auto& [to, from] :
       {std::pair(F::part_width, S::width), std::pair(F::depth, S::depth),
        std::pair(F::roughness, S::roughness), std::pair(F::circle_radius, S::circle_radius),
        std::pair(F::circle_residual, S::circle_residual),
        std::pair(F::straight_distance, S::straight_distance), std::pair(F::concavity, S::concavity)})
    mean(track, to, double{(*seen.shape)[static_cast<std::size_t>(from)]}, dt);
}

void observe_legs(Track& track, const TrackObservation& seen, double dt) {
  using F = TrackFeature;
  mean(track, F::width_difference, seen.width_difference, dt);
  average(at(track.features, F::two_segments), seen.segments == 2 ? 1 : 0, dt);
  mean(track, F::second_log_odds, seen.segments == 2 ? seen.second_log_odds : -4, dt);
  if (seen.segments != 2) return;
  const double change = std::abs(seen.leg_distance - double{track.feature(F::leg_distance)});
  average(at(track.features, F::gait), change, dt);
  average(at(track.features, F::leg_distance), seen.leg_distance, dt);
}

void observe_motion(Track& track, double dt) {
  using F = TrackFeature;
  const double s = std::min(dt / (kPlaceAveraging + dt), 1.0);
  track.average_place += s * (track.position() - track.average_place);
  if ((track.position() - track.arrival_place).norm() > kStay) {
    track.arrival_place = track.position();
    track.arrival = track.stamp;
  }
  at(track.features, F::displacement) = static_cast<float>((track.position() - track.average_place).norm());
  at(track.features, F::travelled) =
      static_cast<float>(std::min((track.position() - track.birth_place).norm(), 3.0));
  at(track.features, F::speed) = static_cast<float>(track.velocity().norm());
  at(track.features, F::age) = static_cast<float>(std::min((track.stamp - track.born).seconds(), 5.0));
}

void observe_features(Track& track, const TrackObservation& seen, double dt) {
  using F = TrackFeature;
  mean(track, F::segment_log_odds, seen.log_odds, dt);
  observe_shape(track, seen, dt);
  average(at(track.features, F::newly_occupied), seen.free_fraction, dt);
  average(at(track.features, F::long_occupied), seen.old_occupied, dt, 1.0);
  average(at(track.features, F::before_it), seen.before_it, dt);
  float& moved = at(track.features, F::has_moved);
  moved -= static_cast<float>(double{moved} * std::min(dt / kMemoryOfMotion, 1.0));
  moved = std::max(moved, track.feature(F::newly_occupied));
  mean(track, F::width_change, std::abs(seen.width - double{track.feature(F::width)}), dt);
  average(at(track.features, F::width), seen.width, dt);
  average(at(track.features, F::neighbours), seen.neighbours, dt);
  average(at(track.features, F::missed), 0, dt);
  at(track.features, F::range) = static_cast<float>(seen.range);
  at(track.features, F::laser_height) = static_cast<float>(seen.laser_height);
  observe_legs(track, seen, dt);
}

void correct(Track& track, const TrackObservation& seen) {
  const Eigen::Matrix2d S =
      track.covariance.topLeftCorner<2, 2>() + Eigen::Matrix2d::Identity() * seen.sigma * seen.sigma;
  const Eigen::Matrix<double, 4, 2> K = track.covariance.leftCols<2>() * S.inverse();
  track.state += K * (seen.position - track.position());
  track.covariance -= K * track.covariance.topRows<2>();
  track.covariance = (track.covariance + track.covariance.transpose().eval()) / 2;
  const double speed = track.velocity().norm();
  if (speed > kMaxSpeed) track.state.tail<2>() *= kMaxSpeed / speed;
}

}  // namespace

const char* to_string(MoverClass kind) {
  switch (kind) {
    case MoverClass::person:
      return "person";
    case MoverClass::robot:
      return "robot";
    case MoverClass::other:
      return "other";
  }
  return "other";
}

Eigen::Vector2d Track::average_velocity() const {
  const double age = std::max((stamp - born).seconds(), 0.2);
  return (position() - average_place) / (kPlaceAveraging * (1 - std::exp(-age / kPlaceAveraging)));
}

Track begin_track(std::uint32_t id, const TrackObservation& seen, SimulationTime stamp) {
  Track track;
  track.id = id;
  track.state.head<2>() = track.birth_place = track.average_place = track.arrival_place = seen.position;
  track.covariance.diagonal() << seen.sigma * seen.sigma, seen.sigma * seen.sigma, kStartSpeed * kStartSpeed,
      kStartSpeed * kStartSpeed;
  track.stamp = track.born = track.seen = track.arrival = stamp;
  track.sight = {stamp, seen.position, Eigen::Vector2d::Zero()};
  track.scans = 1;
  using F = TrackFeature;
  at(track.features, F::leg_distance) = static_cast<float>(seen.leg_distance);
  at(track.features, F::width) = static_cast<float>(seen.width);
  constexpr double kAllAtOnce = 1e6;  // s: averages start with the first value
  observe_features(track, seen, kAllAtOnce);
  return track;
}

void predict(Track& track, SimulationTime stamp) {
  const double dt = (stamp - track.stamp).seconds();
  track.stamp = stamp;
  if (!(dt > 0)) return;
  Eigen::Matrix4d F = Eigen::Matrix4d::Identity();
  F(0, 2) = F(1, 3) = dt;
  track.state = F * track.state;
  track.covariance = F * track.covariance * F.transpose();
  // White noise of acceleration: the same at any rate of scans.
  for (const int i : {0, 1}) {
    track.covariance(i, i) += kAcceleration * dt * dt * dt / 3;
    track.covariance(i, i + 2) += kAcceleration * dt * dt / 2;
    track.covariance(i + 2, i) += kAcceleration * dt * dt / 2;
    track.covariance(i + 2, i + 2) += kAcceleration * dt;
  }
}

void update(Track& track, const TrackObservation& seen, SimulationTime stamp, double dt) {
  correct(track, seen);
  track.seen = stamp;
  ++track.scans;
  observe_features(track, seen, dt);
  observe_motion(track, dt);
  // Who came does not become what was there before: the track may have stayed behind at some furniture.
  const bool doubtful = seen.before_it > 0.5 && track.feature(TrackFeature::has_moved) > 0.5F;
  if (!doubtful) track.sight = {stamp, track.position(), track.average_velocity()};
}

void observe_part(Track& track, Leg& leg, const Eigen::Vector2d& place, double since) {
  float& shift = at(track.features, TrackFeature::part_shift);
  if (!(since > 0)) {
    leg.place = leg.former_place = place;
    return;
  }
  leg.place += (place - leg.place) * (since / (kPartAveraging + since));
  leg.former_place += (place - leg.former_place) * (since / (kFormerAveraging + since));
  shift -= static_cast<float>(double{shift} * std::min(since / kMemoryOfMotion, 1.0));
  shift = std::max(shift, static_cast<float>(std::min((leg.place - leg.former_place).norm(), kMaxShift)));
}

void observe_others(Track& track, double moved, std::size_t tracks) {
  const double others = moved - double{track.feature(TrackFeature::has_moved)};
  at(track.features, TrackFeature::others_moved) =
      static_cast<float>(tracks > 1 ? others / static_cast<double>(tracks - 1) : 0);
}

void miss(Track& track, double dt) {
  average(at(track.features, TrackFeature::missed), 1, dt);
  observe_motion(track, dt);
}

}  // namespace parhelion::people
