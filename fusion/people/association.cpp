#include "fusion/people/association.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "fusion/people/track_rules.hpp"

namespace parhelion::people {
namespace {

constexpr double kLegSigma = 0.14;         // m: a leg between two scans, beyond the motion of the body
constexpr double kUnknownLegSigma = 0.25;  // m: a leg that was not seen lately
constexpr double kMaxSigmas = 4.5;
constexpr double kMaxTwoLegsWidth = 0.45;  // m
constexpr std::ptrdiff_t kMaxParts = 40;   // possible ones of a track
constexpr double kDirectedSpeed = 0.2;     // m/s: slower ones have no direction

/// Where a leg is expected.
struct Expected {
  bool possible = true;
  Eigen::Vector2d place;  ///< m, map
  double sigma = 0;       ///< m
};

Expected expect(const Track& track, std::uint32_t slot) {
  const Leg &leg = track.legs[slot], &other = track.legs[1 - slot];
  const double body = std::min(track.covariance(0, 0), leg.known || other.known ? 0.3 * 0.3 : 1.0);
  const double own = leg.known ? kLegSigma : kUnknownLegSigma;
  Expected expected{leg.known || other.known || slot == 0, track.position(), std::sqrt(body + own * own)};
  if (leg.known) {
    expected.place += leg.offset;
  } else if (other.known) {
    expected.place -= other.offset;
  }
  return expected;
}

using F = PairFeature;

void set(PairFeatures& features, F which, double value) {
  features[static_cast<std::size_t>(which)] = static_cast<float>(value);
}

/// What all pairs of a track have in common.
void describe_track(const Track& track, double dt, PairFeatures& features) {
  using T = TrackFeature;
  for (const auto& [to, from] :
       {std::pair(F::has_moved, T::has_moved), std::pair(F::before_it, T::before_it),
        std::pair(F::two_segments, T::two_segments), std::pair(F::track_width, T::width),
        std::pair(F::missed, T::missed), std::pair(F::age, T::age)})
    set(features, to, double{track.feature(from)});
  set(features, F::unseen, (track.stamp - track.seen).seconds());
  set(features, F::speed, track.average_velocity().norm());
  set(features, F::track_log_odds, std::clamp(track.log_odds, -6.0, 6.0) + (track.person ? 3 : 0));
  set(features, F::sigma, std::sqrt(track.covariance(0, 0)));
  set(features, F::clearance, track.clearance);
  set(features, F::dt, dt);
}

}  // namespace

void Association::Nearest::add(std::uint32_t candidate, double at) {
  if (candidate == index) {
    distance = std::min(distance, at);
  } else if (at < distance) {
    second = distance;
    distance = at;
    index = candidate;
  } else {
    second = std::min(second, at);
  }
}

void Association::reserve(std::size_t tracks, std::size_t segments, std::size_t parts) {
  parts_.reserve(parts);
  centers_.reserve(segments);
  segment_.reserve(2 * tracks);
  for (std::vector<Nearest>* rivals : {&person_, &person_sigmas_, &thing_}) rivals->reserve(segments);
}

std::span<const PossiblePart> Association::find(std::span<const Track> tracks,
                                                std::span<const Segment> segments,
                                                std::span<const SegmentEvidence> evidence, double dt) {
  parts_.clear();
  centers_.clear();
  for (const Segment& segment : segments) centers_.add(segment.center);
  person_.assign(segments.size(), {});
  person_sigmas_.assign(segments.size(), Nearest(9));
  thing_.assign(segments.size(), {});
  segment_.assign(2 * tracks.size(), {});
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const std::size_t first = parts_.size();
    add_pairs(static_cast<std::uint32_t>(i), tracks[i], segments);
    keep_nearest(first);
  }
  for (std::size_t first = 0, last = 0; first < parts_.size(); first = last) {
    const std::uint32_t track = parts_[first].track;
    while (last < parts_.size() && parts_[last].track == track) ++last;
    describe(first, last, tracks[track], segments, evidence, dt);
  }
  return parts_;
}

void Association::add_pairs(std::uint32_t index, const Track& track, std::span<const Segment> segments) {
  const std::array<Expected, 2> expected{expect(track, 0), expect(track, 1)};
  const Eigen::Vector2d place = track.position();
  centers_.each(place, kMaxLegOffset, [&](std::size_t near) {
    const auto s = static_cast<std::uint32_t>(near);
    const Segment& segment = segments[s];
    if ((segment.center - place).squaredNorm() > kMaxLegOffset * kMaxLegOffset) return true;
    for (const std::uint32_t slot : {0U, 1U}) {
      const Expected& here = expected[slot];
      const Eigen::Vector2d off = segment.center - here.place;
      const double distance = off.norm();
      if (!here.possible || distance > kMaxSigmas * here.sigma) continue;
      const bool unknown = !track.legs[slot].known && track.legs[1 - slot].known;
      if (unknown &&
          (segment.width > kMaxLegWidth || double{track.feature(TrackFeature::width)} > kMaxTwoLegsWidth))
        continue;
      parts_.push_back({index, slot, s, off, distance, here.sigma, {}});
      (track.person ? person_ : thing_)[s].add(index, distance);
      if (track.person) person_sigmas_[s].add(index, distance / here.sigma);
      segment_[2 * index + slot].add(s, distance);
    }
    return true;
  });
}

/// Of one track. More are near it only where a scan is no scan of a place.
void Association::keep_nearest(std::size_t first) {
  if (parts_.size() - first <= std::size_t{kMaxParts}) return;
  const auto from = parts_.begin() + static_cast<std::ptrdiff_t>(first), last = from + kMaxParts;
  std::nth_element(from, last, parts_.end(), [](const PossiblePart& a, const PossiblePart& b) {
    return std::tuple(a.distance, a.segment, a.slot) < std::tuple(b.distance, b.segment, b.slot);
  });
  parts_.erase(last, parts_.end());
  std::sort(from, parts_.end(), [](const PossiblePart& a, const PossiblePart& b) {
    return std::tuple(a.segment, a.slot) < std::tuple(b.segment, b.slot);
  });
}

void Association::describe(std::size_t first, std::size_t last, const Track& track,
                           std::span<const Segment> segments, std::span<const SegmentEvidence> evidence,
                           double dt) {
  PairFeatures common{};
  describe_track(track, dt, common);
  const Eigen::Vector2d velocity = track.average_velocity();
  const double speed = velocity.norm();
  const Eigen::Vector2d ahead =
      speed > kDirectedSpeed ? Eigen::Vector2d(velocity / speed) : Eigen::Vector2d::Zero();
  for (PossiblePart& part : std::span(parts_).subspan(first, last - first)) {
    part.features = common;
    set(part.features, F::along, part.off.dot(ahead));
    set(part.features, F::body_distance, (segments[part.segment].center - track.position()).norm());
    describe_leg(part, track, segments[part.segment], dt);
    describe_segment(part, track, segments[part.segment], evidence[part.segment]);
  }
}

void Association::describe_leg(PossiblePart& part, const Track& track, const Segment& segment, double dt) {
  const Leg &leg = track.legs[part.slot], &other = track.legs[1 - part.slot];
  PairFeatures& features = part.features;
  set(features, F::distance, part.distance);
  set(features, F::sigmas, part.distance / part.sigma);
  set(features, F::swing_distance, leg.known ? (part.off - dt * leg.swing).norm() : part.distance);
  set(features, F::known, (leg.known ? 2 : 0) + (other.known ? 1 : 0));
  set(features, F::width_change, leg.known ? segment.width - leg.width : 0);
}

void Association::describe_segment(PossiblePart& part, const Track& track, const Segment& segment,
                                   const SegmentEvidence& evidence) const {
  PairFeatures& features = part.features;
  set(features, F::segment_log_odds, evidence.log_odds);
  set(features, F::width, segment.width);
  set(features, F::occluded, segment.occluded ? 1 : 0);
  set(features, F::free_fraction, evidence.place.free_fraction());
  set(features, F::old_occupied, evidence.place.old_occupied);
  set(features, F::there_before,
      std::clamp((evidence.place.occupied_for - (track.stamp - track.arrival)).seconds(), -5.0, 5.0));
  set(features, F::person_rival, person_[part.segment].except(part.track));
  set(features, F::person_rival_sigmas, person_sigmas_[part.segment].except(part.track));
  set(features, F::thing_rival, thing_[part.segment].except(part.track));
  set(features, F::other_segment, segment_[2 * part.track + part.slot].except(part.segment));
  set(features, F::laser_height,
      double{segment.features[static_cast<std::size_t>(SegmentFeature::laser_height)]});
  set(features, F::range, segment.range);
}

void PairLogOdds::reserve(std::size_t parts) {
  log_odds_.reserve(parts);
  wanted_.reserve(parts);
}

std::span<const float> PairLogOdds::find(const Trees& trees, std::span<const PossiblePart> parts) {
  const std::size_t first = std::min(trees.trees.size(), kFirstTrees);
  log_odds_.assign(parts.size(), trees.start);
  wanted_.resize(parts.size());
  std::iota(wanted_.begin(), wanted_.end(), 0U);
  add(trees.trees.first(first), parts);
  std::erase_if(wanted_, [&](std::uint32_t i) { return log_odds_[i] < kHopeless; });
  add(trees.trees.subspan(first), parts);
  return log_odds_;
}

/// To those that are wanted.
void PairLogOdds::add(std::span<const Tree> trees, std::span<const PossiblePart> parts) {
  add_to_each<kPairFeatures>(
      trees, wanted_.size(), [&](std::size_t i) -> const PairFeatures& { return parts[wanted_[i]].features; },
      [&](std::size_t i) -> float& { return log_odds_[wanted_[i]]; });
}

}  // namespace parhelion::people
