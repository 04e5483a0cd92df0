#include "server/simulation/world/unconstrained_motion.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::simulation {
namespace {

// Bounds of motion until the next decision, of which there are twenty a second.
constexpr double kLookahead = 0.06;  // s
constexpr double kUnforeseen = 0.5;  // m and m/s: accelerations, corrections of the real robot's pose
constexpr double kSettle = 0.2;      // m of hysteresis for agents in the solver
constexpr double kArm = 2.0;         // m that a robot with joints may reach beyond its footprint
constexpr double kDoor = 1.0;        // m: reach of a moving door leaf

double speed_of(const Agent& agent) {
  return agent.rigid.velocity.norm() + agent.rigid.rotation_rate.norm() * agent.form.size.norm();
}

/// Minimum distance from another body with this speed.
double room_for(const Agent& agent, double speed) {
  return kUnforeseen + kLookahead * (agent.rigid.velocity.norm() + speed + kUnforeseen) +
         (agent.unconstrained ? 0 : kSettle);
}

}  // namespace

bool ContactForecast::untouchable(const Agent& agent, const Surroundings& around) {
  constexpr double range = 4.0;  // m, search range for obstacles and agents slower than 40 m/s
  if (speed_of(agent) > 10) return false;
  around.neighbours.near(agent.placed.center, range + kArm, nearby_);
  for (const std::uint32_t i : nearby_) {
    const Agent& other = around.agents[i];
    if (&other == &agent) continue;
    const double room = room_for(agent, speed_of(other)) + (other.robot ? kArm : 0);
    if (distance_bound(agent.placed, other.placed) < room) return false;
  }
  for (const RealRobot& real : around.real_robots) {
    if (!real.ever_present) continue;
    const double speed =
        std::hypot(real.last.twist.vx, real.last.twist.vy) + std::abs(real.last.twist.wz) * real.placed.bound;
    const double room = room_for(agent, speed) + (real.twin ? real.twin->reach() : 0);
    if (distance_bound(agent.placed, real.placed) < room) return false;
  }
  near_.clear();
  around.building().near(agent.placed.center, agent.placed.bound + room_for(agent, 0) + kDoor,
                         agent.floor - 0.01, agent.floor + agent.form.size.z() + 0.01, near_);
  disc_.vertices.assign(1, agent.placed.center);
  disc_.radius = disc_.bound = agent.placed.bound;
  disc_.center = agent.placed.center;
  return std::none_of(near_.begin(), near_.end(), [&](const FixedObstacle* obstacle) {
    const double room = room_for(agent, 0) + (obstacle->label == EntityLabel::door ? kDoor : 0);
    return distance_bound(disc_, obstacle->footprint) < room &&
           signed_distance(disc_, obstacle->footprint) < room;
  });
}

void set_unconstrained(Agent& agent, bool unconstrained, Physics& physics) {
  if (agent.unconstrained == unconstrained) return;
  agent.unconstrained = unconstrained;
  physics.suspend(agent.handle, unconstrained);
  if (!unconstrained) physics.set_motion(agent.handle, agent.rigid);
}

void constrain_all(Agents& agents, Physics& physics) {
  for (Agent& agent : agents) set_unconstrained(agent, false, physics);
}

void constrain_near(const Footprint& placed, Agents& agents, Physics& physics) {
  for (Agent& agent : agents) {
    if (agent.unconstrained && distance_bound(agent.placed, placed) < room_for(agent, 0) + kArm)
      set_unconstrained(agent, false, physics);
  }
}

void move_unconstrained(Agent& agent, double dt) {
  RigidState& rigid = agent.rigid;
  const double turn = rigid.rotation_rate.z();
  if (rigid.velocity.isZero(0) && turn == 0) return;
  agent.pose.x += rigid.velocity.x() * dt;
  agent.pose.y += rigid.velocity.y() * dt;
  agent.pose.yaw = wrap_angle(agent.pose.yaw + turn * dt);
  rigid.T_map_body = Transform<Map, Body>::planar(agent.pose.x, agent.pose.y, agent.pose.yaw,
                                                  rigid.T_map_body.translation().z());
}

}  // namespace parhelion::simulation
