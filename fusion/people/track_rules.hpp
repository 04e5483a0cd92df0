// Which segments may belong to a track, and which tracks to one person.
#pragma once

#include <cstdint>

#include "fusion/people/people_tracker.hpp"

namespace parhelion::people {

inline constexpr double kMaxLegOffset = 0.8;       // m, of a segment from its track's predicted place
inline constexpr double kMaxNewLegDistance = 0.6;  // m, between the legs of a new track
inline constexpr double kMaxStride = 0.9;          // m, between the legs of one person
inline constexpr double kPersonRadius = 0.5;       // m: what is nearer to a person belongs to that person
inline constexpr double kCompanionDistance = 0.6, kCloseCompanionDistance = 0.4;  // m
inline constexpr double kMaxLegWidth = 0.3;  // m: a wider segment is two legs or a body
inline constexpr Duration kYoung = seconds(0.7);
inline constexpr double kCompanionSpeed = 0.8;  // m/s, difference of average velocities
inline constexpr double kRobotMargin = 0.2;     // m
inline constexpr Duration kLegMemory = seconds(0.6);
inline constexpr double kLogOddsAveraging = 0.15;      // s
inline constexpr Duration kLostMemory = seconds(5.0);  ///< a lost person is recognised again within this time
inline constexpr Duration kMergeAfter = seconds(0.4);
inline constexpr Duration kAloneFor = seconds(0.4);  // to be nobody's part later
inline constexpr Duration kLent =
    seconds(5.0);  ///< for this long a recognised person counts as the lost one did

struct ObservedSegment {
  const Segment& segment;
  const SegmentEvidence& evidence;
};
/// `eye`: m, map: the laser. `track`: the one that is observed, or nullptr: a new one.
TrackObservation observe_one(const Segment& segment, const SegmentEvidence& evidence,
                             const Eigen::Vector2d& eye, const Track* track);
TrackObservation observe_two(const ObservedSegment& a, const ObservedSegment& b, const Eigen::Vector2d& eye,
                             const Track* track);

bool pair_of_legs(const Segment& a, const SegmentEvidence& evidence_a, const Segment& b,
                  const SegmentEvidence& evidence_b);
/// The place was occupied before the track came: the segment is not what the track was.
bool was_there_before(const Track& track, const SegmentEvidence& evidence, SimulationTime now);
/// Seen with both legs, or as a body.
bool complete(const Track& track);
/// Was a person at such a distance from all others that it cannot be another person's leg.
bool stood_alone(const Track& track);
/// A part that is tracked by itself although it is one of `whole`, the other leg for example.
bool belongs_to(const Track& part, const Track& whole);
/// Distance of a newly found person from where a lost one may be by now, as a ratio; below 1: may be the
/// same.
double separation(const Track& lost, const Track& found);
/// Has been seen at places that were free before.
bool moves(const Track& track);

}  // namespace parhelion::people
