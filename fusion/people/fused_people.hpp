// The people whom several sensors follow together: tracks of one person by several lasers and depth cameras
// are one person, who keeps the identity from one sensor's view to the other's, and over a short time out of
// all views.
//
// Sightings that stay close to each other make a body. Each sighting votes for the person whom it has been
// of, and more where that person was expected; the persons are assigned to the bodies with the most votes
// (Hungarian method). So the better confirmed identity survives where two become one, it goes back to its
// owner where one becomes two, and where one sensor's tracker mixes two people up, the others' votes decide.
//
// Each sensor has a tracker of its own, so that a robot with a wrong pose or a bad sensor spoils nothing of
// the others' tracks. Estimates are joined by fast covariance intersection (Niehsen: "Information Fusion
// based on Fast Covariance Intersection Filtering", FUSION 2002), which stays consistent although all tracks
// assume the same motion.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "fusion/people/assignment.hpp"
#include "fusion/people/mover.hpp"

namespace parhelion::people {

struct FusionOptions {
  double gate = 16;            ///< squared Mahalanobis distance of two tracks of one person: 4 sigma
  double max_gap = 0.8;        ///< m between them, whatever their covariances
  double pose_sigma = 0.06;    ///< m, 1 sigma of a sensor's position beside what its tracks include
  double max_speed_gap = 1.0;  ///< m/s between the velocities of tracks that are to become one person
  Duration confirm =
      seconds(0.6);  ///< after this time close together two persons become one, and apart one becomes two
  Duration remembered = seconds(3.0);  ///< an unseen person is recognised again within this time
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
  using Key = std::pair<std::size_t, std::uint32_t>;  // sensor, track
  static constexpr std::size_t kVotes = 4;
  static constexpr auto kEnd = static_cast<std::size_t>(-1);
  /// How long a track has recently belonged to a person.
  struct Vote {
    std::uint32_t person = 0;  ///< 0: none
    double weight = 0;         ///< s
  };
  /// One sensor's track of a person.
  struct Sighting {
    Key key;
    Mover mover;  ///< as reported ...
    Mover here;   ///< ... and at `now`
    bool fresh = false;
    double unseen = 0;         ///< s since the previous call without returns
    std::uint32_t person = 0;  ///< 0: of nobody known yet
    bool joined = false;       ///< of this person since this call
    std::array<Vote, kVotes> votes{};
    SimulationTime voted, began;
    std::size_t body = 0, next = kEnd;  ///< index of the first sighting of its body, and of the next one
  };
  /// Of two sightings near each other.
  struct Bond {
    bool together = false;     ///< of one body at the previous call
    bool fits = false;         ///< may be of one person ...
    SimulationTime since;      ///< ... or not, since then
    bool near = false;         ///< at this call ...
    std::size_t a = 0, b = 0;  ///< ... its sightings' indices
  };
  struct Edge {
    double cost;
    std::size_t a, b;
    bool operator<(const Edge& other) const {
      return std::tie(cost, a, b) < std::tie(other.cost, other.a, other.b);
    }
  };
  /// Sightings that are of one person.
  struct Body {
    std::uint32_t person = 0;
    int fresh = 0;  ///< number of sightings with returns
  };
  struct Pairing {
    double cost;
    std::size_t body, person;
    bool operator<(const Pairing& other) const {
      return std::tie(cost, body, person) < std::tie(other.cost, other.body, other.person);
    }
  };

  void replace(std::size_t sensor, std::span<const Mover> movers, SimulationTime now);
  Sighting begin(const Key& key, const Mover& mover, SimulationTime now);
  std::vector<Sighting>::iterator find(const Key& key);
  bool fit(const Sighting& a, const Sighting& b, double wide = 1) const;
  void observe_bonds(SimulationTime now);
  void observe_bond(std::size_t i, std::size_t j, SimulationTime now);
  bool may_join(std::size_t a, std::size_t b) const;
  void gather();
  void identify(SimulationTime now);
  void add_candidates(std::uint32_t body, SimulationTime now);
  void recognise(SimulationTime now);
  static double votes_for(const Sighting& sighting, std::uint32_t person);
  double weight_of(const Sighting& sighting, const FusedPerson& person) const;
  double continues(const Sighting& sighting, const FusedPerson& person) const;
  void vote();
  const Sighting* leader(const FusedPerson& person) const;
  void estimate(SimulationTime now);

  FusionOptions options_;
  std::vector<Sighting> sightings_;   // by sensor, then track
  std::vector<Sighting> ended_;       // lately
  std::vector<FusedPerson> persons_;  // ascending id; those whom nobody sees, too
  std::vector<FusedPerson> shown_;
  std::map<std::pair<Key, Key>, Bond> bonds_;
  std::vector<Edge> edges_;
  std::vector<Body> bodies_;  // at the index of the first sighting
  std::vector<Pairing> pairings_;
  std::vector<Candidate> candidates_;
  Assignment assignment_;
  std::uint32_t last_id_ = 0;
};

}  // namespace parhelion::people
