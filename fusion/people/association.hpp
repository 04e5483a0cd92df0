// How probable it is that a segment of a scan is a part of a track: log-odds that a classifier gives to each
// possible pair, from where the part was expected, what the segment looks like, what was at its place before,
// and which other tracks and segments would fit as well.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/people/near_places.hpp"
#include "fusion/people/person_trees.hpp"
#include "fusion/people/seen_free.hpp"
#include "fusion/people/segments.hpp"
#include "fusion/people/track.hpp"

namespace parhelion::people {

/// What was found out about one segment of the newest scan.
struct SegmentEvidence {
  double log_odds = 0;  ///< of being part of a person, by its shape
  PlaceEvidence place;
};

/// Order of the features of a pair of a track's slot (leg) and a segment. Metres and seconds.
enum class PairFeature : std::uint8_t {
  distance,          ///< of the segment from the expected place of the leg
  sigmas,            ///< the same in standard deviations
  swing_distance,    ///< the same where the leg swung on for `dt` as it did
  along,             ///< the part of it in the track's direction, signed; 0 where that is not known
  body_distance,     ///< of the segment from the track's place
  known,             ///< 2 where this leg was seen lately, plus 1 where the other was
  unseen,            ///< since the track had returns
  segment_log_odds,  ///< of the segment, by its shape
  width,             ///< of the segment
  width_change,      ///< less that of the leg when last seen; 0 where unknown
  occluded,          ///< 1: something hides a part of the segment
  free_fraction,     ///< of the segment's place
  old_occupied,      ///< number of older scans with a return there
  there_before,      ///< how long the place is occupied less how long the track is about here, within 5
  has_moved,         ///< TrackFeature of the same name
  before_it,         ///< TrackFeature of the same name
  two_segments,      ///< TrackFeature of the same name
  track_width,       ///< TrackFeature::width
  missed,            ///< TrackFeature of the same name
  age,               ///< TrackFeature of the same name
  speed,             ///< m/s, of the track, average
  track_log_odds,    ///< of the track being a person's; 3 more where it is confirmed
  sigma,             ///< of the track's place
  person_rival,      ///< distance of the segment from the nearest expected part of another person, at most 1
  thing_rival,       ///< the same of other tracks
  other_segment,     ///< distance of the nearest other segment from this leg's expected place, at most 1
  person_rival_sigmas,  ///< the first in standard deviations, at most 9
  clearance,            ///< of the track's place
  laser_height,
  dt,     ///< between the scans
  range,  ///< of the segment
  count
};
inline constexpr std::size_t kPairFeatures = static_cast<std::size_t>(PairFeature::count);
using PairFeatures = std::array<float, kPairFeatures>;

/// A segment that may be part `slot` of a track.
struct PossiblePart {
  std::uint32_t track = 0, slot = 0, segment = 0;  ///< indices
  Eigen::Vector2d off = Eigen::Vector2d::Zero();   ///< m, map: from the expected place of the part
  double distance = 0;                             ///< m, its length
  double sigma = 0;                                ///< m, of the expected place
  PairFeatures features{};
};

/// How probable the pairs of a scan are, four at a time. Memory is reused from scan to scan.
class PairLogOdds {
 public:
  /// Most pairs are clearly improbable after the first trees; these get only the sum so far.
  static constexpr std::size_t kFirstTrees = 60;
  static constexpr float kHopeless = -4;

  void reserve(std::size_t parts);
  /// Log-odds that the segment is part of the track, of each pair: the same bits as one by one. Valid until
  /// the next call.
  std::span<const float> find(const Trees& trees, std::span<const PossiblePart> parts);

 private:
  void add(std::span<const Tree> trees, std::span<const PossiblePart> parts);

  std::vector<float> log_odds_;
  std::vector<std::uint32_t> wanted_;  // indices of pairs
};

/// Memory is reused from scan to scan.
class Association {
 public:
  void reserve(std::size_t tracks, std::size_t segments, std::size_t parts);

  /// All pairs that are possible at all, by track; tracks are predicted to the scan. `dt`: s since the scan
  /// before. Valid until the next call.
  std::span<const PossiblePart> find(std::span<const Track> tracks, std::span<const Segment> segments,
                                     std::span<const SegmentEvidence> evidence, double dt);

 private:
  /// The two nearest of different others.
  struct Nearest {
    double distance = 1, second = 1;
    Nearest() = default;
    explicit Nearest(double limit) : distance(limit), second(limit) {}
    std::uint32_t index = 0xFFFFFFFF;
    void add(std::uint32_t candidate, double at);
    double except(std::uint32_t own) const { return own == index ? second : distance; }
  };
  void add_pairs(std::uint32_t index, const Track& track, std::span<const Segment> segments);
  void keep_nearest(std::size_t first);
  void describe(std::size_t first, std::size_t last, const Track& track, std::span<const Segment> segments,
                std::span<const SegmentEvidence> evidence, double dt);
  static void describe_leg(PossiblePart& part, const Track& track, const Segment& segment, double dt);
  void describe_segment(PossiblePart& part, const Track& track, const Segment& segment,
                        const SegmentEvidence& evidence) const;

  std::vector<PossiblePart> parts_;
  NearPlaces centers_;                                   // of each segment
  std::vector<Nearest> person_, thing_, person_sigmas_;  // of each segment
  std::vector<Nearest> segment_;                         // of each slot
};

}  // namespace parhelion::people
