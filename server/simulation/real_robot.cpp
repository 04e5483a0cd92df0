#include <algorithm>
#include <cmath>

#include "server/simulation/state.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kZoneSpacing = 0.10;  // m between two footprints of the zone

}  // namespace

void Simulation::State::stop_zone(const RealRobotState& now, std::vector<Footprint>& zone,
                                  double later) const {
  const Pose2 pose = planar_pose(now.T_map_base);
  const double speed = fastest_point_speed(real.footprint, now.twist);
  const double way =
      speed * (real.limits.reaction_time + later) + speed * speed / (2 * real.limits.deceleration);
  const int steps = static_cast<int>(std::min(1000.0, std::ceil(way / kZoneSpacing)));
  for (int i = 0; i <= steps; ++i) {
    const double t = steps > 0 ? way / speed * i / steps : 0;
    Footprint footprint;
    place(real.footprint, advance(pose, now.twist, t), footprint);
    footprint.radius += kStopMargin;
    footprint.bound += kStopMargin;
    zone.push_back(std::move(footprint));
  }
}

void Simulation::State::clear_return_of_real(const RealRobotState& now, bool all) {
  const auto returns = [&](const auto& agent) { return all || agent->shown == AgentShown::returning; };
  if (std::none_of(agents.begin(), agents.end(), returns)) return;
  std::vector<Footprint> zone;
  stop_zone(now, zone);
  for (const auto& agent : agents) {
    if (!returns(agent)) continue;
    agent->clear_of_real = true;
    const bool inside = std::any_of(zone.begin(), zone.end(), [&](const Footprint& footprint) {
      return distance_bound(footprint, agent->placed) <= 0 && signed_distance(footprint, agent->placed) <= 0;
    });
    if (!inside) continue;
    const auto place_for_it = nearest_free(agent->form, agent->pose, agent.get(), zone);
    if (!place_for_it) {
      agent->clear_of_real = false;
      continue;
    }
    put(*agent, *place_for_it);
    say(EventKind::agent_moved, *agent, 0,
        "out of the way: it would have reappeared where the robot could not stop");
  }
}

void Simulation::State::move_real(const std::optional<RealRobotState>& now) {
  const bool valid = now && now->T_map_base.finite() && finite(now->twist);
  if (!valid) {
    if (real.present) {
      contacts.forget(real.name, stamp_of(step), events);
      real.watch.close(stamp_of(step), options.zones, events);
    }
    real.present = real.touchable = real.sensed = false;
    physics.suspend(real.handle, true);
    return;
  }
  const bool jumped = !real.present || now->relocalized;
  if (jumped) {
    ++real.epoch;
    contacts.forget(real.name, stamp_of(step), events);
  }
  // Agents come back into its sensors' view: none so near that it could not stop.
  clear_return_of_real(*now, now->sensed && (jumped || !real.sensed));
  real.last = *now;
  if (now->relocalized) real.last.twist = {};
  real.present = real.ever_present = true;
  real.touchable = !jumped;
  real.sensed = now->sensed;
  place(real.footprint, planar_pose(now->T_map_base), real.placed);
  if (jumped) wake_near(real.placed);
  physics.suspend(real.handle, jumped);
  const Eigen::Isometry3d& base = now->T_map_base.isometry();
  physics.move_kinematic(real.handle, Transform<Map, Body>(base),
                         base.linear() * Eigen::Vector3d(real.last.twist.vx, real.last.twist.vy, 0),
                         base.linear() * Eigen::Vector3d(0, 0, real.last.twist.wz));
}

}  // namespace parhelion::simulation
