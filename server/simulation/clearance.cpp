#include "server/simulation/clearance.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::simulation {
namespace {

constexpr double kContact = 0.001;  // m: a smaller distance is contact
constexpr int kMaxAdvances = 500;
constexpr double kProbe = 0.005;  // m of test motion that shows whether it leads out of a contact

/// m that the fastest point of `local` moves until it touches `obstacle`, at most `limit` (conservative
/// advancement: the gap closes no faster than the fastest point moves, so each advance by the gap is safe).
double swept_distance(const Footprint& local, const Pose2& pose, const Twist2& twist, double speed,
                      const Footprint& obstacle, double limit, Footprint& placed) {
  double travel = 0;
  for (int n = 0; travel < limit && n < kMaxAdvances; ++n) {
    place(local, advance(pose, twist, travel / speed), placed);
    const double gap = signed_distance(placed, obstacle);
    if (gap <= kContact) return travel;
    travel += gap;
  }
  return std::min(travel, limit);
}

}  // namespace

Simulation::Clearance clearance(const Footprint& local, const Agents& agents, const std::string& held,
                                const Transform<Map, Base>& T_map_base, const Twist2& twist, double limit,
                                Footprint& placed) {
  const Pose2 pose = planar_pose(T_map_base);
  const double speed = fastest_point_speed(local, twist);
  Simulation::Clearance result{limit, false, {}};
  bool touching = false, leads_out = true;
  for (const Agent& agent : agents) {
    const Footprint& other = agent.placed;
    if (agent.definition.name == held) continue;
    place(local, pose, placed);
    if (distance_bound(placed, other) > limit) continue;
    const double gap = signed_distance(placed, other);
    double travel = std::min(gap, limit);
    if (gap <= kContact) {
      travel = 0;
      if (speed > 0) place(local, advance(pose, twist, kProbe / speed), placed);
      const bool out = speed > 0 && signed_distance(placed, other) > gap;
      touching = true;
      leads_out = leads_out && out;
      if (out) continue;  // the contact ends; other agents determine the distance
    } else if (speed > 0) {
      travel = swept_distance(local, pose, twist, speed, other, limit, placed);
    }
    if (travel < result.distance) {
      result.distance = travel;
      result.agent = agent.definition.name;
    }
  }
  result.moving_out = touching && leads_out;
  return result;
}

}  // namespace parhelion::simulation
