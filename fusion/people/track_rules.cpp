#include "fusion/people/track_rules.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::people {
namespace {

constexpr double kWide = 0.26;  // m: wider than a leg: a body, or two legs beside each other
constexpr double kLegDepth = 0.04, kBodyDepth = 0.1;  // m from the returns to the middle
constexpr double kPairSigma = 0.07, kBodySigma = 0.09, kOneLegSigma = 0.15, kThingSigma = 0.07;  // m

Eigen::Vector2d behind(const Eigen::Vector2d& p, const Eigen::Vector2d& eye, double depth) {
  const Eigen::Vector2d ray = p - eye;
  const double range = ray.norm();
  return range > 1e-6 ? Eigen::Vector2d(p + ray / range * depth) : p;
}

// Somebody lost goes on for a while, then may have stopped, turned or gone faster.
constexpr double kKeepsGoing = 0.7;     // s
constexpr double kLostRadius = 0.9;     // m, at once: a pose that jumps, too ...
constexpr double kLostSpeed = 0.8;      // m/s, by which it grows ...
constexpr double kMaxLostRadius = 2.5;  // m

bool two_legged(const Track& track) { return track.feature(TrackFeature::two_segments) > 0.2F; }

/// One leg of it swings while the body goes on evenly.
bool walks(const Track& track) { return two_legged(track) || track.feature(TrackFeature::has_moved) > 0.5F; }

/// Of two alike the newer one is the part; but a thing that looks more like a person than the older one is
/// not: furniture must not swallow who steps up to it.
bool may_be_part(const Track& part, const Track& whole) {
  if (part.person != whole.person) return !part.person;
  return part.id > whole.id && (part.person || part.log_odds <= whole.log_odds);
}

}  // namespace

bool complete(const Track& track) { return two_legged(track) || track.feature(TrackFeature::width) > 0.3F; }

TrackObservation observe_one(const Segment& segment, const SegmentEvidence& evidence,
                             const Eigen::Vector2d& eye, const Track* track) {
  TrackObservation seen;
  const bool wide = segment.width > kWide;
  seen.position = behind(segment.center, eye, wide ? kBodyDepth : kLegDepth);
  seen.sigma = wide ? kBodySigma : track != nullptr && walks(*track) ? kOneLegSigma : kThingSigma;
  seen.segments = 1;
  seen.log_odds = evidence.log_odds;
  seen.shape = &segment.features;
  seen.free_fraction = evidence.place.free_fraction();
  seen.old_occupied = std::min(evidence.place.old_occupied / 6.0, 1.0);
  if (track != nullptr) seen.before_it = was_there_before(*track, evidence, track->stamp) ? 1 : 0;
  seen.width = segment.width;
  seen.neighbours = double{segment.features[static_cast<std::size_t>(SegmentFeature::neighbours)]};
  seen.range = segment.range;
  seen.laser_height = double{segment.features[static_cast<std::size_t>(SegmentFeature::laser_height)]};
  return seen;
}

TrackObservation observe_two(const ObservedSegment& a, const ObservedSegment& b, const Eigen::Vector2d& eye,
                             const Track* track) {
  TrackObservation seen = observe_one(a.segment, a.evidence, eye, track);
  const TrackObservation second = observe_one(b.segment, b.evidence, eye, track);
  seen.position = (behind(a.segment.center, eye, kLegDepth) + behind(b.segment.center, eye, kLegDepth)) / 2;
  seen.sigma = kPairSigma;
  seen.segments = 2;
  if (second.log_odds > seen.log_odds) seen.shape = second.shape;
  seen.width_difference = std::abs(a.segment.width - b.segment.width);
  seen.second_log_odds = std::min(seen.log_odds, second.log_odds);
  seen.log_odds = std::max(seen.log_odds, second.log_odds);
  seen.free_fraction = std::max(seen.free_fraction, second.free_fraction);
  seen.old_occupied = std::min(seen.old_occupied, second.old_occupied);
  seen.before_it = std::min(seen.before_it, second.before_it);
  seen.leg_distance = (a.segment.center - b.segment.center).norm();
  seen.width = seen.leg_distance + (a.segment.width + b.segment.width) / 2;
  return seen;
}

bool pair_of_legs(const Segment& a, const SegmentEvidence& evidence_a, const Segment& b,
                  const SegmentEvidence& evidence_b) {
  return a.width < kMaxLegWidth && b.width < kMaxLegWidth && evidence_a.log_odds > -1 &&
         evidence_b.log_odds > -1;
}

bool was_there_before(const Track& track, const SegmentEvidence& evidence, SimulationTime now) {
  return evidence.place.occupied_for > (now - track.arrival) + milliseconds(300);
}

bool stood_alone(const Track& track) { return track.alone >= kAloneFor.seconds() || track.lent > 0; }

bool belongs_to(const Track& part, const Track& whole) {
  const double apart = (whole.position() - part.position()).norm();
  if (apart > kCompanionDistance || !may_be_part(part, whole)) return false;
  // Two who meet remain two, however few returns are left of them.
  if (stood_alone(part) && stood_alone(whole)) return false;
  // Who was a person for a while is not part of another only for standing close by, and nothing that is not
  // close is missing from a complete one.
  const bool persons = part.confirmed.ns != 0 && whole.confirmed.ns != 0;
  if (apart > kCloseCompanionDistance && (persons || complete(whole))) return false;
  const bool young = part.stamp - part.born < kYoung;  // has no average yet
  if (!young && (whole.average_velocity() - part.average_velocity()).norm() > kCompanionSpeed) return false;
  // Two people side by side are each seen with two legs, or as a body.
  return !(complete(part) && complete(whole));
}

double separation(const Track& lost, const Track& found) {
  // A track that began while the other was seen was a part or a neighbour then: only its place now counts.
  const bool later = found.born > lost.sight.stamp;
  const double t = ((later ? found.born : found.seen) - lost.sight.stamp).seconds();
  const double going = kKeepsGoing * (1 - std::exp(-t / kKeepsGoing));
  const Eigen::Vector2d expected = lost.sight.position + going * lost.sight.velocity;
  return ((later ? found.birth_place : found.position()) - expected).norm() /
         std::min(kLostRadius + kLostSpeed * t, kMaxLostRadius);
}

bool moves(const Track& track) {
  return track.feature(TrackFeature::has_moved) > 0.6F && track.feature(TrackFeature::travelled) > 0.5F;
}

}  // namespace parhelion::people
