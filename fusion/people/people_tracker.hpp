// People and other movers around the robots, from planar lasers: segments of a scan, each with the evidence
// that it is a leg or a body and that its place was free before, are assigned to tracks of one or two
// segments (legs) by classified pairs; another classifier tells persons from things. After Leigh, Pineau,
// Olmedo, Zhang: "Person Tracking and Following with 2D Laser Scanners", ICRA 2015; the evidence of places
// that were seen free replaces its local grid.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fusion/people/assignment.hpp"
#include "fusion/people/association.hpp"
#include "fusion/people/mover.hpp"
#include "fusion/people/near_places.hpp"
#include "fusion/people/person_trees.hpp"
#include "fusion/people/seen_free.hpp"
#include "fusion/people/segments.hpp"
#include "fusion/people/track.hpp"

namespace parhelion::people {

struct PeopleOptions {
  SegmentOptions segments;
  SeenFreeOptions seen_free;
  Trees segment = segment_trees(), track = track_trees(), pair = pair_trees();
  std::size_t max_tracks = 400;
  double min_log_odds_person = 0.5;           ///< from which a track is a person
  double max_log_odds_not_person = -0.9;      ///< below which it no longer is
  double min_log_odds_person_unmoved = 0.75;  ///< the same of a track that was never seen to move
  double max_log_odds_not_person_unmoved = -0.1;
  std::uint32_t min_scans = 3;                    ///< two, 0.16 s apart, for a newcomer who is plain to see
  Duration max_hidden = seconds(2.0);             ///< a person behind something else is kept
  Duration max_missed = seconds(0.6);             ///< where nothing hides it
  Duration max_thing_missed = milliseconds(350);  ///< of what is not a person
};

/// Deterministic. Allocates nothing after warm-up, and its time is bounded for any scan.
class PeopleTracker {
 public:
  explicit PeopleTracker(const PeopleOptions& options = {});

  /// The movers after this scan, in ascending id: persons, and others that have moved. Valid until the next
  /// call. A scan older than the newest is ignored.
  std::span<const Mover> update(const LaserSweep& sweep);
  std::span<const Mover> movers() const { return movers_; }

  /// For training and tests: all tracks, persons or not, the segments of the newest scan, and which of them
  /// may be part of which track.
  std::span<const Track> tracks() const { return tracks_; }
  std::span<const Segment> segments() const { return found_; }
  /// Its `track` counts the tracks as they were before the newest scan.
  std::span<const PossiblePart> parts() const { return parts_; }

 private:
  void collect_evidence(const LaserSweep& sweep);
  void assign();
  void update_track(const LaserSweep& sweep, std::size_t index);
  TrackObservation observe(const LaserSweep& sweep, const Track* track, std::int32_t a, std::int32_t b) const;
  void move_leg(Track& track, std::uint32_t slot, std::int32_t segment, const Leg& before) const;
  void remember_legs(Track& track, std::int32_t a, std::int32_t b, SimulationTime stamp) const;
  void begin_tracks(const LaserSweep& sweep);
  std::int32_t second_leg(std::size_t first) const;
  bool near_person(const Eigen::Vector2d& place) const;
  void merge_companions();
  bool away_from_persons(const Track& track) const;
  bool things_move() const;
  bool plain_to_see(const Track& track) const;
  void classify(const LaserSweep& sweep);
  void recognise();
  Track* lost_like(const Track& found);
  void forget(const LaserSweep& sweep);
  static double clearance(const LaserSweep& sweep, const Track& track);
  void report();

  PeopleOptions options_;
  SegmentedScan segmented_;
  std::vector<SeenFree> seen_free_;  // for each laser
  std::span<const Segment> found_;
  std::vector<SegmentEvidence> evidence_;  // for each segment
  std::vector<float> log_odds_;            // of each segment, or track
  std::vector<char> taken_;                // for each segment
  Association association_;
  std::span<const PossiblePart> parts_;
  PairLogOdds pair_log_odds_;
  Assignment assignment_;
  std::vector<Candidate> candidates_;
  std::vector<std::int32_t> segment_of_slot_;  // two for each track
  std::vector<Track> tracks_;                  // ascending id
  std::vector<Track> lost_;                    // ended ones of persons
  NearPlaces places_;                          // of each track
  std::vector<Mover> movers_;
  SimulationTime newest_;
  double dt_ = 0;  // s between the newest scans
  std::uint32_t last_id_ = 0;
};

}  // namespace parhelion::people
