#include "server/simulation/events/pose_conflicts.hpp"

#include <cmath>

namespace parhelion::simulation {
namespace {

/// m of overlap beyond what is explained; 0 or less: no conflict.
double unexplained_overlap(const RealRobot& one, const RealRobot& other) {
  const double allowed =
      PoseConflicts::kOverlap + PoseConflicts::kSigmas * std::hypot(one.last.sigma, other.last.sigma);
  if (!(distance_bound(one.placed, other.placed) < -allowed)) return 0;
  return -signed_distance(one.placed, other.placed) - allowed;
}

}  // namespace

bool overlap_in_height(const RealRobot& one, const RealRobot& other) {
  const double z = one.last.T_map_base.translation().z(), z_other = other.last.T_map_base.translation().z();
  return z <= z_other + other.height && z_other <= z + one.height;
}

bool poses_conflict(const RealRobot& one, const RealRobot& other) {
  return one.present && other.present && overlap_in_height(one, other) && unexplained_overlap(one, other) > 0;
}

void PoseConflicts::update(const RealRobots& robots, SimulationTime now, std::vector<Event>& events) {
  for (std::size_t i = 0; i < robots.size(); ++i) {
    for (std::size_t j = i + 1; j < robots.size(); ++j) {
      if (!poses_conflict(robots[i], robots[j])) continue;
      const auto [known, is_new] = open_.insert_or_assign({i, j}, now);
      if (!is_new) continue;
      Event event;
      event.stamp = now;
      event.kind = EventKind::poses_conflict;
      event.subject = robots[i].name;
      event.object = robots[j].name;
      event.pair = PairKind::real_real;
      event.position = robots[i].last.T_map_base.translation();
      event.value = unexplained_overlap(robots[i], robots[j]);
      event.text =
          "both robots are estimated to be in one place: check the localization of each, and that no two "
          "robots publish on one channel";
      events.push_back(std::move(event));
    }
  }
  std::erase_if(open_, [&](const auto& each) { return (now - each.second).seconds() > kHold; });
}

}  // namespace parhelion::simulation
