// Two real robots whose estimated poses cannot both be right: their outlines overlap.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "protocols/event.hpp"
#include "server/simulation/bodies/real_robot.hpp"

namespace parhelion::simulation {

/// Whether both occupy a common height.
bool overlap_in_height(const RealRobot& one, const RealRobot& other);
/// Whether their outlines overlap more than kOverlap and kSigmas of the poses' uncertainty explain.
bool poses_conflict(const RealRobot& one, const RealRobot& other);

class PoseConflicts {
 public:
  static constexpr double kOverlap = 0.10;  // m: outlines are simplified, and bumpers give way
  static constexpr double kSigmas = 3;
  static constexpr double kHold = 1.0;  // s without a conflict until the same one is reported again
  /// At each step: reports poses_conflict at the start of each conflict, once a pair.
  void update(const RealRobots& robots, SimulationTime now, std::vector<Event>& events);

 private:
  std::map<std::pair<std::size_t, std::size_t>, SimulationTime> open_;  // last seen, by RealRobot::index
};

}  // namespace parhelion::simulation
