// Near misses: objects that a robot passed too closely or nearly hit, without contact.
#pragma once

#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "server/simulation/bodies/watches.hpp"

namespace parhelion::simulation {

/// An object nearby or ahead.
struct Neighbour {
  std::string_view name;
  PairKind pair = PairKind::none;
  bool undetectable = false;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map: its point nearest to the robot
};

/// Reports near_miss at the end of an encounter without contact: by distance (text "gap", value: m, the
/// smallest gap, at most kGap), by time (text "time", value: s, the shortest time to collision, at most
/// kTime), or both. Only instants when the robot itself moves faster than kMinSpeed count: passing at a crawl
/// is deliberate, and a standing robot is passed by others. Where the encounter began within kGap, only the
/// time counts. It ends when for kHold the robot stood, or the object was farther than kAway and not ahead
/// within kTimeAway. One second as the limit of serious conflicts: Hayward, Near-miss determination through
/// use of a scale of danger, Highway Research Record 384, 1972.
class NearMissWatch {
 public:
  static constexpr double kGap = 0.20, kAway = 0.30;     // m
  static constexpr double kTime = 1.0, kTimeAway = 1.5;  // s
  static constexpr double kMinSpeed = 0.10;              // m/s, of its fastest point
  static constexpr double kHold = 0.5;                   // s

  /// An encounter is active: update at each step.
  bool open() const { return !open_.empty(); }
  /// An encounter may end at the next step: check it then.
  bool leaving() const;
  /// Starts a check.
  void begin_check(SimulationTime now) { checked_at_ = now; }
  /// At each check, for objects within kAway: the gap (m).
  void near(const Neighbour& thing, double gap, bool moves, SimulationTime now);
  /// The first object on the path: s until contact.
  void ahead(const Neighbour& thing, double time, bool moves, SimulationTime now);
  /// An object in contact.
  void touch(std::string_view name, SimulationTime now);
  /// Marks all tracked objects for which touched(name) is true as in contact, also for a standing robot that
  /// is no longer checked.
  template <class Touched>
  void touch_if(Touched touched) {
    for (auto& each : open_) each.second.touched = each.second.touched || touched(each.first);
  }
  /// At each step, after the check: reports near_miss for encounters that ended without contact.
  void update(const Supervised& body, const ObservedMotion& motion, std::vector<Event>& events);

 private:
  struct Closest {
    double value = std::numeric_limits<double>::infinity();
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
  };
  struct Encounter {
    PairKind pair = PairKind::none;
    bool undetectable = false, touched = false;
    bool came = false;   ///< it was farther than kGap before
    bool stays = false;  ///< near at its newest check: not away before the next one
    Closest gap, time;
    SimulationTime seen;
  };
  Encounter& meet(const Neighbour& thing, SimulationTime now);
  std::map<std::string, Encounter, std::less<>> open_;
  SimulationTime checked_at_;
};

}  // namespace parhelion::simulation
