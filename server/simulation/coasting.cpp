// Upright agents that nothing can touch before they decide again are moved without the solver, by the same
// laws: where they are, what sensors see and what events say is what it would be with it. Who may be touched
// is back in the solver before that.
#include <algorithm>
#include <cmath>

#include "server/simulation/state.hpp"

namespace parhelion::simulation {
namespace {

// What may happen before the next look, of which there are twenty a second.
constexpr double kLook = 0.06;       // s
constexpr double kUnforeseen = 0.5;  // m and m/s: accelerations, corrections of the real robot's pose
constexpr double kSettle = 0.2;      // m more for who is in the solver, so that nobody goes to and fro
constexpr double kArm = 2.0;         // m that a robot with joints may reach beyond its footprint
constexpr double kDoor = 1.0;        // m: a leaf may swing

double speed_of(const Agent& agent) {
  return agent.rigid.velocity.norm() + agent.rigid.rotation_rate.norm() * agent.form.size.norm();
}

/// How near another may be that has this speed.
double room_for(const Agent& agent, double speed) {
  return kUnforeseen + kLook * (agent.rigid.velocity.norm() + speed + kUnforeseen) +
         (agent.coasts ? 0 : kSettle);
}

}  // namespace

bool Simulation::State::alone(const Agent& agent) {
  constexpr double range = 4.0;  // m, of obstacles and of agents that go at less than 40 m/s
  if (speed_of(agent) > 10) return false;
  neighbours.near(agent.placed.center, range + kArm, nearby);
  for (const std::uint32_t i : nearby) {
    const Agent& other = *agents[i];
    if (&other == &agent) continue;
    const double room = room_for(agent, speed_of(other)) + (other.robot ? kArm : 0);
    if (distance_bound(agent.placed, other.placed) < room) return false;
  }
  if (real.ever_present) {
    const double speed =
        std::hypot(real.last.twist.vx, real.last.twist.vy) + std::abs(real.last.twist.wz) * real.placed.bound;
    if (distance_bound(agent.placed, real.placed) < room_for(agent, speed)) return false;
  }
  near.clear();
  building->near(agent.placed.center, agent.placed.bound + room_for(agent, 0) + kDoor, agent.floor - 0.01,
                 agent.floor + agent.form.size.z() + 0.01, near);
  own_disc.vertices.assign(1, agent.placed.center);
  own_disc.radius = own_disc.bound = agent.placed.bound;
  own_disc.center = agent.placed.center;
  return std::none_of(near.begin(), near.end(), [&](const FixedObstacle* obstacle) {
    const double room = room_for(agent, 0) + (obstacle->label == EntityLabel::door ? kDoor : 0);
    return distance_bound(own_disc, obstacle->footprint) < room &&
           signed_distance(own_disc, obstacle->footprint) < room;
  });
}

std::size_t Simulation::coasting() const {
  return static_cast<std::size_t>(std::count_if(state_->agents.begin(), state_->agents.end(),
                                                [](const auto& agent) { return agent->coasts; }));
}

void Simulation::State::set_coasting(Agent& agent, bool coasts) {
  if (agent.coasts == coasts) return;
  agent.coasts = coasts;
  physics.suspend(agent.handle, coasts);
  if (!coasts) physics.set_motion(agent.handle, agent.rigid);
}

void Simulation::State::wake_all() {
  for (const auto& agent : agents) set_coasting(*agent, false);
}

void Simulation::State::wake_near(const Footprint& placed) {
  for (const auto& agent : agents) {
    if (agent->coasts && distance_bound(agent->placed, placed) < room_for(*agent, 0) + kArm)
      set_coasting(*agent, false);
  }
}

void Simulation::State::coast(Agent& agent) {
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
