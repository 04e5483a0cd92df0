// One track: a Kalman filter with constant velocity, its legs, and the evidence that it is a person.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "fusion/people/mover.hpp"
#include "fusion/people/segments.hpp"
#include "protocols/time.hpp"

namespace parhelion::people {

/// Order of the features of a track. Averages are exponential over half a second; a mean is over the whole
/// track, or about its last three seconds.
enum class TrackFeature : std::uint8_t {
  segment_log_odds,  ///< mean of its more person-like segment
  second_log_odds,   ///< mean of the other one; -4 without
  two_segments,      ///< fraction of scans with both
  newly_occupied,    ///< average of PlaceEvidence::free_fraction
  has_moved,         ///< largest such average, forgotten over half a minute
  long_occupied,     ///< average fraction of older scans that had a return there
  before_it,         ///< average fraction of scans in which the place had been occupied before the track came
  displacement,      ///< m between the place and its average over one second
  travelled,         ///< m from where it began, at most 3
  speed,             ///< m/s
  age,               ///< s, at most 5
  width,             ///< m, average, over both segments
  leg_distance,      ///< m, average between the segments; 0 without
  gait,              ///< m, average of how much the distance of the segments differs from its average
  laser_height,      ///< m
  neighbours,        ///< average number of other segments around it
  missed,            ///< average fraction of scans in which nothing was found for it
  range,             ///< m
  part_width,        ///< m, mean width of the more person-like segment
  depth,             ///< m, mean of SegmentFeature::depth of it, and so on
  roughness,
  circle_radius,
  circle_residual,
  straight_distance,
  concavity,
  width_difference,  ///< m, mean between its segments; 0 without
  width_change,      ///< m, mean of how much the width differs from its average: a robot's does not
  part_shift,        ///< m, by which one of its parts has been set elsewhere, forgotten over half a minute
  others_moved,      ///< mean TrackFeature::has_moved of the other tracks: 1 where the pose is not known
  count
};
inline constexpr std::size_t kTrackFeatures = static_cast<std::size_t>(TrackFeature::count);
using TrackFeatures = std::array<float, kTrackFeatures>;

/// Where somebody was last seen without doubt.
struct LastSight {
  SimulationTime stamp;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< m, map
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< m/s, map: average over about the last second
};

/// One of two parts of a track.
struct Leg {
  bool known = false;
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();  ///< m, map: from the track's position
  Eigen::Vector2d swing = Eigen::Vector2d::Zero();   ///< m/s, map: how the offset changes
  double width = 0;                                  ///< m, of its last segment
  SimulationTime seen;
  Eigen::Vector2d place = Eigen::Vector2d::Zero();         ///< m, map: average over a few scans ...
  Eigen::Vector2d former_place = Eigen::Vector2d::Zero();  ///< ... and over some seconds
};

/// What a scan shows of a track.
struct TrackObservation {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< m, map
  double sigma = 0;                                    ///< m
  int segments = 0;                                    ///< 1 or 2
  double log_odds = 0, second_log_odds = 0;
  double free_fraction = 0, old_occupied = 0, before_it = 0;
  const SegmentFeatures* shape = nullptr;  ///< of the more person-like segment
  double width_difference = 0;
  double width = 0, leg_distance = 0, neighbours = 0, range = 0, laser_height = 0;
};

struct Track {
  std::uint32_t id = 0;
  Eigen::Vector4d state = Eigen::Vector4d::Zero();  ///< x, y, vx, vy; m, m/s, map
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  SimulationTime stamp, born, seen;
  Eigen::Vector2d birth_place = Eigen::Vector2d::Zero();
  Eigen::Vector2d average_place = Eigen::Vector2d::Zero();
  Eigen::Vector2d arrival_place = Eigen::Vector2d::Zero();  ///< it has stayed about here ...
  SimulationTime arrival;                                   ///< ... since then
  LastSight sight;
  std::array<Leg, 2> legs;
  double clearance = 0;  ///< m that the newest scan sees beyond its place, within 1; negative: it is hidden
  std::uint32_t scans = 0;  ///< with returns from it
  TrackFeatures features{};
  double log_odds = 0;          ///< that it is a person: average over 0.15 s
  bool person = false;          ///< confirmed ...
  SimulationTime confirmed;     ///< ... for the first time
  bool robot = false;           ///< at the place of a known robot
  std::uint32_t companion = 0;  ///< id of another track very close to it
  double companion_time = 0;    ///< s with a companion, less those without
  double alone = 0;  ///< s as a person more than a stride from all other persons, at most kAloneFor
  /// s in which it still counts as alone, because the lost person that it was recognised as had stood alone
  double lent = 0;

  Eigen::Vector2d position() const { return state.head<2>(); }
  Eigen::Vector2d velocity() const { return state.tail<2>(); }
  /// m/s, map: average over about the last second, in which the swing of a leg cancels out.
  Eigen::Vector2d average_velocity() const;
  float feature(TrackFeature which) const { return features[static_cast<std::size_t>(which)]; }
};

Track begin_track(std::uint32_t id, const TrackObservation& seen, SimulationTime stamp);
/// To `stamp`, with random accelerations.
void predict(Track& track, SimulationTime stamp);
/// `dt`: s since the track's last scan.
void update(Track& track, const TrackObservation& seen, SimulationTime stamp, double dt);
void miss(Track& track, double dt);
/// `moved`: sum of TrackFeature::has_moved over all `tracks`, this one included.
void observe_others(Track& track, double moved, std::size_t tracks);
/// One of its parts is at `place` (m, map) now. `since`: s since the part was last seen; 0: it is new.
void observe_part(Track& track, Leg& leg, const Eigen::Vector2d& place, double since);

}  // namespace parhelion::people
