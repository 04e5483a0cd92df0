// Near misses: what a robot passed too near, or would soon have hit, and did not touch.
#pragma once

#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "server/simulation/watches.hpp"

namespace parhelion::simulation {

/// Something that is near, or ahead.
struct Neighbour {
  std::string_view name;
  PairKind pair = PairKind::none;
  bool unsensed = false;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map: its point nearest to the robot
};

/// near_miss, once an encounter is over that never became a contact: by distance (text "gap", value: m, the
/// smallest gap, at most kGap), by time (text "time", value: s, the least time to a collision, at most
/// kTime), or both. Only what is so while the robot itself moves faster than kCareful counts: who creeps past
/// does so on purpose, and who stands is passed by others. Where it began an encounter within kGap, only the
/// time counts. It is over when for kHold the robot stood, or the thing was farther than kAway and not ahead
/// within kTimeAway. A second as the limit of serious conflicts: Hayward, Near-miss determination through use
/// of a scale of danger, Highway Research Record 384, 1972.
class NearMissWatch {
 public:
  static constexpr double kGap = 0.20, kAway = 0.30;     // m
  static constexpr double kTime = 1.0, kTimeAway = 1.5;  // s
  static constexpr double kCareful = 0.10;               // m/s, of its fastest point
  static constexpr double kHold = 0.5;                   // s

  /// Something was near, or is: to be updated at each step.
  bool open() const { return !open_.empty(); }
  /// Something may be away at the next step: to be looked at then.
  bool leaving() const;
  /// A check begins.
  void begin_check(SimulationTime now) { looked_ = now; }
  /// At each check, of what is no farther than kAway: the gap to it (m).
  void near(const Neighbour& thing, double gap, bool moves, SimulationTime now);
  /// Of what would be hit first: s until then.
  void ahead(const Neighbour& thing, double time, bool moves, SimulationTime now);
  /// Of what it touches.
  void touch(std::string_view name, SimulationTime now);
  /// The same of all that was near or ahead, also of what a robot that stands does not check any more.
  template <class Touched>
  void touch_if(Touched touched) {
    for (auto& each : open_) each.second.touched = each.second.touched || touched(each.first);
  }
  /// At each step, after the check: reports the encounters that are over.
  void update(const Supervised& body, const ObservedMotion& motion, std::vector<Event>& events);

 private:
  struct Closest {
    double value = std::numeric_limits<double>::infinity();
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
  };
  struct Encounter {
    PairKind pair = PairKind::none;
    bool unsensed = false, touched = false;
    bool came = false;   ///< it was farther than kGap before
    bool stays = false;  ///< at the newest check that saw it: not away before the next one
    Closest gap, time;
    SimulationTime seen;
  };
  Encounter& meet(const Neighbour& thing, SimulationTime now);
  std::map<std::string, Encounter, std::less<>> open_;
  SimulationTime looked_;
};

}  // namespace parhelion::simulation
