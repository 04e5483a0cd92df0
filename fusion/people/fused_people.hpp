// The people whom several sensors follow together: tracks of one person by several lasers and depth cameras
// are one person, who keeps the identity from one sensor's view to the other's, and over a short time out of
// all views.
//
// Each sensor has a tracker of its own, so that a robot with a wrong pose or a bad sensor spoils nothing of
// the others' tracks. Estimates are joined by fast covariance intersection (Niehsen: "Information Fusion
// based on Fast Covariance Intersection Filtering", FUSION 2002), which stays consistent although all tracks
// assume the same motion.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "fusion/people/mover.hpp"

namespace parhelion::people {

struct FusionOptions {
  double gate = 16;                 ///< squared Mahalanobis distance of two tracks of one person: 4 sigma
  double max_gap = 0.8;             ///< m between them, whatever their covariances
  double pose_sigma = 0.06;         ///< m, 1 sigma of a sensor's position beside what its tracks include
  double max_speed_gap = 1.0;       ///< m/s between the velocities of tracks that are to become one person
  Duration confirm = seconds(0.6);  ///< so long close: two persons become one; so long apart: one becomes two
  Duration remembered = seconds(3.0);  ///< a person whom nobody sees is recognised for so long
  Duration stale =
      milliseconds(150);  ///< a track without returns for longer may have been taken over by another
  double body = 0.35;     ///< m: two tracks of one sensor that are nearer are parts of one person
  double wander = 0.7;    ///< m/s: the gate of somebody unseen grows by this
};

/// A person as all sensors show it.
struct FusedPerson {
  std::uint32_t id = 0;                                  ///< from 1, never given again
  Eigen::Vector2d position = Eigen::Vector2d::Zero();    ///< m, map, at `stamp`
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();    ///< m/s, map
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< of x, y, vx, vy; m and s
  double radius = 0;                                     ///< m
  SimulationTime stamp, seen;                            ///< seen: instant of the last scan with returns
  std::size_t sensors = 0;  ///< number of tracks of it that have returns now, or else of all
};

/// Deterministic: a function of the calls.
class FusedPeople {
 public:
  explicit FusedPeople(const FusionOptions& options = {}) : options_(options) {}

  /// Replaces what a sensor shows: `movers` are those of its tracker after the newest scan, in ascending id;
  /// only persons count. `now`: not before that of the previous call.
  void set(std::size_t sensor, std::span<const Mover> movers, SimulationTime now);
  /// The persons whom at least one sensor follows, in ascending id, at the `now` of the last set().
  std::span<const FusedPerson> persons() const { return shown_; }

 private:
  struct Sighting {  ///< one sensor's track of a person
    std::size_t sensor = 0;
    Mover mover;
    std::uint32_t person = 0;  ///< 0: of nobody known yet
    SimulationTime linked;     ///< since when it is of this person
    SimulationTime fits;       ///< when it last was near the person's other sightings
  };
  struct Pairing {
    double cost;
    std::size_t sighting, person;
    bool operator<(const Pairing& other) const {
      return std::tie(cost, sighting, person) < std::tie(other.cost, other.sighting, other.person);
    }
  };

  void replace(std::size_t sensor, std::span<const Mover> movers);
  void split(SimulationTime now);
  void link(SimulationTime now);
  void merge(SimulationTime now);
  void estimate(SimulationTime now);
  bool seen_by(std::uint32_t person, std::size_t sensor) const;
  bool fit(const Sighting& a, const Sighting& b, SimulationTime now) const;
  bool may_be(const Sighting& sighting, std::uint32_t person, SimulationTime now) const;
  bool fresh(const Sighting& sighting, SimulationTime now) const {
    return now - sighting.mover.seen <= options_.stale;
  }
  bool seen_by_same_sensor(std::uint32_t a, std::uint32_t b) const;

  FusionOptions options_;
  std::vector<Sighting> sightings_;   // by sensor, then track
  std::vector<FusedPerson> persons_;  // ascending id; those whom nobody sees, too
  std::vector<FusedPerson> shown_;
  std::vector<Pairing> pairings_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, SimulationTime> close_since_;
  std::uint32_t last_id_ = 0;
};

}  // namespace parhelion::people
