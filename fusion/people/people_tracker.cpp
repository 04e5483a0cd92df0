#include "fusion/people/people_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fusion/people/track_rules.hpp"

namespace parhelion::people {

namespace {

constexpr std::size_t kCandidates = 8192;
constexpr double kOccluder = 0.2;         // m in front of a person who is hidden
constexpr double kSwingAveraging = 0.08;  // s
/// A pair is taken from log-odds of minus this on: to miss a part is worse than to take a neighbour's once.
constexpr double kUnassigned = 0.5;
/// Two scans this far apart show as much as three of a laser with 12 scans a second: enough for somebody who
/// is plain to see.
constexpr Duration kTwoScans = milliseconds(160);
constexpr double kPlainToSee = 1.2;    // log-odds
constexpr double kNearby = 1.5;        // m: a new track this near to a person is often of that person
constexpr double kMaxUnwatched = 0.2;  // s: of a longer gap between two scans no more counts as seen

}  // namespace

PeopleTracker::PeopleTracker(const PeopleOptions& options) : options_(options), segmented_(options.segments) {
  tracks_.reserve(options.max_tracks);
  lost_.reserve(options.max_tracks);
  places_.reserve(options.max_tracks);
  movers_.reserve(options.max_tracks);
  segment_of_slot_.reserve(2 * options.max_tracks);
  // Enough for all but the largest scans, whose first one sets the size.
  evidence_.reserve(options.max_tracks);
  log_odds_.reserve(options.max_tracks);
  taken_.reserve(options.max_tracks);
  candidates_.reserve(kCandidates);
  association_.reserve(options.max_tracks, options.max_tracks, kCandidates);
  pair_log_odds_.reserve(kCandidates);
  assignment_.reserve(2 * options.max_tracks, options.max_tracks, kCandidates);
}

std::span<const Mover> PeopleTracker::update(const LaserSweep& sweep) {
  if (!tracks_.empty() && sweep.stamp < newest_) return movers_;
  dt_ = std::clamp((sweep.stamp - newest_).seconds(), 0.0, 1.0);
  newest_ = sweep.stamp;
  if (seen_free_.size() <= sweep.laser) seen_free_.resize(sweep.laser + 1, SeenFree(options_.seen_free));
  found_ = segmented_.find(sweep);
  collect_evidence(sweep);
  for (Track& track : tracks_) {
    predict(track, sweep.stamp);
    track.clearance = clearance(sweep, track);
  }
  assign();
  for (std::size_t i = 0; i < tracks_.size(); ++i) update_track(sweep, i);
  begin_tracks(sweep);
  merge_companions();
  classify(sweep);
  recognise();
  forget(sweep);
  report();
  seen_free_[sweep.laser].add(sweep);
  return movers_;
}

void PeopleTracker::collect_evidence(const LaserSweep& sweep) {
  evidence_.clear();
  log_odds_.assign(found_.size(), options_.segment.start);
  add_to_each<kSegmentFeatures>(
      options_.segment.trees, found_.size(),
      [&](std::size_t i) -> const SegmentFeatures& { return found_[i].features; },
      [&](std::size_t i) -> float& { return log_odds_[i]; });
  for (std::size_t i = 0; i < found_.size(); ++i) {
    const Segment& segment = found_[i];
    evidence_.push_back(
        {double{log_odds_[i]}, seen_free_[sweep.laser].at(segment.center, std::min(segment.radius, 0.25),
                                                          sweep.sigma, sweep.stamp)});
  }
}

void PeopleTracker::assign() {
  candidates_.clear();
  parts_ = association_.find(tracks_, found_, evidence_, dt_);
  const std::span<const float> log_odds = pair_log_odds_.find(options_.pair, parts_);
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const PossiblePart& part = parts_[i];
    const double cost = -double{log_odds[i]};
    if (cost < kUnassigned) candidates_.push_back({2 * part.track + part.slot, part.segment, cost});
  }
  const auto slots = assignment_.solve(2 * tracks_.size(), found_.size(), candidates_, kUnassigned);
  segment_of_slot_.assign(slots.begin(), slots.end());
  for (std::size_t i = 0; i < segment_of_slot_.size(); i += 2) {
    std::int32_t &a = segment_of_slot_[i], &b = segment_of_slot_[i + 1];
    if (a == Assignment::kNone || b == Assignment::kNone) continue;
    const double stride =
        (found_[static_cast<std::size_t>(a)].center - found_[static_cast<std::size_t>(b)].center).norm();
    if (stride > kMaxStride) b = Assignment::kNone;
  }
  taken_.assign(found_.size(), 0);
  for (const std::int32_t segment : segment_of_slot_)
    if (segment != Assignment::kNone) taken_[static_cast<std::size_t>(segment)] = 1;
}

void PeopleTracker::update_track(const LaserSweep& sweep, std::size_t index) {
  Track& track = tracks_[index];
  std::int32_t a = segment_of_slot_[2 * index], b = segment_of_slot_[2 * index + 1];
  if (a == Assignment::kNone && b == Assignment::kNone) return miss(track, dt_);
  const std::array<Leg, 2> before = track.legs;
  remember_legs(track, a, b, sweep.stamp);
  const TrackObservation seen = observe(sweep, &track, a, b);
  people::update(track, seen, sweep.stamp, dt_);
  for (const std::uint32_t slot : {0U, 1U})
    move_leg(track, slot, segment_of_slot_[2 * index + slot], before[slot]);
}

/// Offsets are about the corrected place.
void PeopleTracker::move_leg(Track& track, std::uint32_t slot, std::int32_t segment,
                             const Leg& before) const {
  if (segment == Assignment::kNone) return;
  Leg& leg = track.legs[slot];
  const Segment& found = found_[static_cast<std::size_t>(segment)];
  leg.offset = found.center - track.position();
  leg.width = found.width;
  const double since = (leg.seen - before.seen).seconds();
  observe_part(track, leg, found.center, before.known ? since : 0);
  if (!before.known || !(since > 0)) {
    leg.swing.setZero();
    return;
  }
  leg.swing += ((leg.offset - before.offset) / since - before.swing) * (since / (kSwingAveraging + since));
}

void PeopleTracker::remember_legs(Track& track, std::int32_t a, std::int32_t b, SimulationTime stamp) const {
  for (const auto& [leg, segment] : {std::pair(&track.legs[0], a), std::pair(&track.legs[1], b)}) {
    if (segment != Assignment::kNone) {
      leg->known = true;
      leg->seen = stamp;
    } else if (stamp - leg->seen > kLegMemory) {
      leg->known = false;
    }
  }
}

TrackObservation PeopleTracker::observe(const LaserSweep& sweep, const Track* track, std::int32_t a,
                                        std::int32_t b) const {
  if (a == Assignment::kNone) std::swap(a, b);
  const auto first = static_cast<std::size_t>(a);
  const Eigen::Vector2d eye = sweep.motion.T_map_laser_end.translation().head<2>();
  if (b == Assignment::kNone) return observe_one(found_[first], evidence_[first], eye, track);
  const auto second = static_cast<std::size_t>(b);
  return observe_two({found_[first], evidence_[first]}, {found_[second], evidence_[second]}, eye, track);
}

void PeopleTracker::begin_tracks(const LaserSweep& sweep) {
  for (std::size_t i = 0; i < found_.size() && tracks_.size() < options_.max_tracks; ++i) {
    if (taken_[i] != 0 || near_person(found_[i].center)) continue;
    taken_[i] = 1;
    const std::int32_t second = second_leg(i);
    if (second != Assignment::kNone) taken_[static_cast<std::size_t>(second)] = 1;
    const auto first = static_cast<std::int32_t>(i);
    Track track = begin_track(++last_id_, observe(sweep, nullptr, first, second), sweep.stamp);
    remember_legs(track, first, second, sweep.stamp);
    move_leg(track, 0, first, {});
    move_leg(track, 1, second, {});
    tracks_.push_back(track);
  }
}

/// The nearest other segment that makes a pair of legs with `first`.
std::int32_t PeopleTracker::second_leg(std::size_t first) const {
  std::int32_t best = Assignment::kNone;
  double nearest = kMaxNewLegDistance;
  for (std::size_t j = first + 1; j < found_.size(); ++j) {
    const double distance = (found_[j].center - found_[first].center).norm();
    if (taken_[j] != 0 || distance >= nearest ||
        !pair_of_legs(found_[first], evidence_[first], found_[j], evidence_[j]))
      continue;
    nearest = distance;
    best = static_cast<std::int32_t>(j);
  }
  return best;
}

bool PeopleTracker::near_person(const Eigen::Vector2d& place) const {
  return std::any_of(tracks_.begin(), tracks_.end(), [&](const Track& track) {
    return track.person && track.seen == newest_ && (track.position() - place).norm() < kPersonRadius;
  });
}

/// Two tracks that stay close to each other are the legs of one person.
void PeopleTracker::merge_companions() {
  places_.clear();
  for (const Track& track : tracks_) places_.add(track.position());
  for (Track& track : tracks_) {
    track.companion = 0;
    places_.each(track.position(), kCompanionDistance, [&](std::size_t j) {
      const Track& whole = tracks_[j];
      if (&whole != &track && belongs_to(track, whole)) track.companion = whole.id;
      return track.companion == 0;
    });
    track.companion_time = std::max(track.companion_time + (track.companion != 0 ? dt_ : -dt_), 0.0);
  }
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    track.lent = std::max(track.lent - dt_, 0.0);
    if (!track.person || track.seen != newest_ || track.alone >= kAloneFor.seconds() ||
        !away_from_persons(track))
      continue;
    track.alone = std::min(track.alone + std::min(dt_, kMaxUnwatched), kAloneFor.seconds());
  }
  std::erase_if(tracks_, [](const Track& track) {
    return track.companion != 0 && track.companion_time >= kMergeAfter.seconds();
  });
}

bool PeopleTracker::away_from_persons(const Track& track) const {
  return std::none_of(tracks_.begin(), tracks_.end(), [&](const Track& other) {
    return &other != &track && other.person &&
           (other.position() - track.position()).squaredNorm() <= kMaxStride * kMaxStride;
  });
}

/// Where what is not a person seems to move, too, the pose is wrong.
bool PeopleTracker::things_move() const {
  constexpr std::ptrdiff_t enough = 4;
  const auto things = std::count_if(tracks_.begin(), tracks_.end(), [](const Track& t) { return !t.person; });
  const auto moved = std::count_if(tracks_.begin(), tracks_.end(), [](const Track& t) {
    return !t.person && t.feature(TrackFeature::has_moved) > 0.5F;
  });
  return things >= enough && 2 * moved >= things;
}

void PeopleTracker::classify(const LaserSweep& sweep) {
  double moved_tracks = 0;
  for (const Track& track : tracks_) moved_tracks += double{track.feature(TrackFeature::has_moved)};
  const bool pose_is_wrong = things_move();
  for (Track& track : tracks_) observe_others(track, moved_tracks, tracks_.size());
  log_odds_.assign(tracks_.size(), options_.track.start);
  add_to_each<kTrackFeatures>(
      options_.track.trees, tracks_.size(),
      [&](std::size_t i) -> const TrackFeatures& { return tracks_[i].features; },
      [&](std::size_t i) -> float& { return log_odds_[i]; });
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    const double log_odds = double{log_odds_[i]};
    const double share = track.scans < 2 ? 1 : dt_ / (kLogOddsAveraging + dt_);
    track.log_odds += (log_odds - track.log_odds) * share;
    track.robot = std::any_of(sweep.robots.begin(), sweep.robots.end(), [&](const KnownRobot& robot) {
      return (track.position() - robot.center).norm() < robot.radius + kRobotMargin;
    });
    const bool moved = track.feature(TrackFeature::has_moved) > 0.5F && !pose_is_wrong;
    const double limit = moved ? options_.min_log_odds_person : options_.min_log_odds_person_unmoved;
    const double lost = moved ? options_.max_log_odds_not_person : options_.max_log_odds_not_person_unmoved;
    const bool enough = (track.scans >= options_.min_scans || plain_to_see(track)) && track.companion == 0;
    track.person = !track.robot && (track.person ? track.log_odds > lost : enough && track.log_odds > limit);
    if (track.person && track.confirmed.ns == 0) track.confirmed = sweep.stamp;
  }
}

/// With two scans, of which this is the second: a newcomer whom no person that is or was tracked can be.
bool PeopleTracker::plain_to_see(const Track& track) const {
  const bool second = track.scans == 2 && track.seen == track.stamp;
  if (!second || track.seen - track.born < kTwoScans || track.log_odds <= kPlainToSee) return false;
  const auto away = [&](const Track& other) {
    return other.confirmed.ns == 0 || (other.position() - track.position()).norm() > kNearby;
  };
  return std::all_of(tracks_.begin(), tracks_.end(), away) && std::all_of(lost_.begin(), lost_.end(), away);
}

/// A person found near where another was lost is that one: the new track gets the old identity.
void PeopleTracker::recognise() {
  for (Track& found : tracks_) {
    if (!found.person || found.confirmed != newest_) continue;
    Track* lost = lost_like(found);
    if (lost == nullptr) continue;
    found.id = std::exchange(lost->id, 0);
    found.confirmed = lost->confirmed;
    // What may be a part of somebody near by, the other leg or a stick, has to be alone itself before long.
    found.lent = lost->alone >= kAloneFor.seconds() ? kLent.seconds() : lost->lent;
    if (complete(found) || away_from_persons(found)) found.alone = lost->alone;
  }
  std::erase_if(tracks_, [](const Track& track) { return track.id == 0; });
  std::erase_if(lost_,
                [&](const Track& track) { return track.id == 0 || newest_ - track.seen > kLostMemory; });
  const auto older = [](const Track& a, const Track& b) { return a.id < b.id; };
  if (!std::is_sorted(tracks_.begin(), tracks_.end(), older))
    std::sort(tracks_.begin(), tracks_.end(), older);
}

/// Of the persons who are not seen now, the one who `found` most probably is, or nullptr.
Track* PeopleTracker::lost_like(const Track& found) {
  Track* best = nullptr;
  double min_separation = 1;
  const auto consider = [&](Track& lost) {
    if (lost.id == 0 || lost.seen == newest_ || lost.confirmed >= found.confirmed) return;
    const double apart = separation(lost, found);
    if (apart >= min_separation) return;
    min_separation = apart;
    best = &lost;
  };
  for (Track& track : tracks_)
    if (track.person) consider(track);
  for (Track& track : lost_) consider(track);
  return best;
}

void PeopleTracker::forget(const LaserSweep& sweep) {
  const auto gone = [&](const Track& track) {
    const Duration missing = sweep.stamp - track.seen;
    if (missing.ns == 0) return false;
    if (!track.person) return missing > options_.max_thing_missed;
    return missing > (clearance(sweep, track) < -kOccluder ? options_.max_hidden : options_.max_missed);
  };
  for (const Track& track : tracks_)
    if (gone(track) && track.confirmed.ns != 0 && lost_.size() < options_.max_tracks) lost_.push_back(track);
  std::erase_if(tracks_, gone);
}

/// How far the laser sees beyond the track's place, m, within 1; outside the field of view, or where the
/// laser's pose is not finite: -1.
double PeopleTracker::clearance(const LaserSweep& sweep, const Track& track) {
  const auto T_laser_map = sweep.motion.T_map_laser_end.inverse();
  const Eigen::Vector2d p = (T_laser_map * Eigen::Vector3d(track.position().x(), track.position().y(),
                                                           sweep.motion.T_map_laser_end.translation().z()))
                                .head<2>();
  if (!p.allFinite()) return -1;
  const auto beam = sweep.scan.beam_at(std::atan2(p.y(), p.x()));
  if (!beam) return -1;
  const float range = sweep.scan.ranges[*beam];
  if (sweep.description.convention.classify(range) != BeamKind::hit) return 1;
  return std::clamp(double{range} - p.norm(), -1.0, 1.0);
}

void PeopleTracker::report() {
  movers_.clear();
  for (const Track& track : tracks_) {
    const bool known = track.person || (track.scans >= options_.min_scans && (track.robot || moves(track)));
    if (!known || track.companion != 0) continue;
    Mover mover;
    mover.id = track.id;
    mover.kind = track.person ? MoverClass::person : track.robot ? MoverClass::robot : MoverClass::other;
    mover.person = 1 / (1 + std::exp(-track.log_odds));
    mover.position = track.position();
    mover.velocity = track.velocity();
    mover.covariance = track.covariance;
    mover.radius = std::max(0.2, double{track.feature(TrackFeature::width)} / 2);
    mover.stamp = track.stamp;
    mover.seen = track.seen;
    movers_.push_back(mover);
  }
}

}  // namespace parhelion::people
