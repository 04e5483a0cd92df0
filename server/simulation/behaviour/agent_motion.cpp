#include "server/simulation/behaviour/agent_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace parhelion::simulation {
namespace {

constexpr double kTurningFeet = 0.3;  // m/rad that feet move in a turn on the spot
constexpr double kSmallSteps = 0.35;  // fraction of a normal step's height and length
constexpr double kStands = 0.05;      // m/s: below this the feet stand

double towards(double from, double to, double max_change) {
  return from + std::clamp(to - from, -max_change, max_change);
}

/// The footprint of an upright agent; for a tilted one the outline of its box.
void place_footprint(Agent& agent) {
  const Eigen::Isometry3d& T_map_body = agent.rigid.T_map_body.isometry();
  if (T_map_body(2, 2) > 0.9999) {
    place(agent.form.footprint, agent.pose, agent.placed);
    return;
  }
  std::vector<Eigen::Vector2d> corners;
  const Eigen::Vector3d& size = agent.form.size;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 1 : 0);
    corners.emplace_back((T_map_body * Eigen::Vector3d(p.cwiseProduct(size))).head<2>());
  }
  agent.placed = make_polygon(convex_hull(std::move(corners)));
}

/// Turns wheels and moves feet according to the body's true motion, also when it is pushed.
void move_parts(Agent& agent, double dt) {
  if (!agent.form.upright) return;
  PartMotion& parts = agent.parts;
  const Eigen::Vector3d v = agent.rigid.T_map_body.rotation().transpose() * agent.rigid.velocity;
  const double w = agent.rigid.rotation_rate.z();
  const double turn = 2 * std::numbers::pi;
  parts.wheel_left =
      wrap_angle(parts.wheel_left + (v.x() - w * kRobotDrive.track / 2) / kRobotDrive.wheel_radius * dt);
  parts.wheel_right =
      wrap_angle(parts.wheel_right + (v.x() + w * kRobotDrive.track / 2) / kRobotDrive.wheel_radius * dt);
  const double speed = std::hypot(v.x(), v.y());
  // A turn on the spot takes steps too, according to the distance that its feet move.
  const double pace = std::max(speed, kTurningFeet * std::abs(w));
  // The gait runs backwards only if the motion is mainly backwards, not sideways.
  const double direction = v.x() < -0.5 * speed ? -1 : 1;
  // The step length is the forward fraction of the motion; sidesteps and turns have short steps, and so more
  // of them.
  const double reach = pace > kStands ? std::max(kSmallSteps, std::abs(v.x()) / pace) : 0;
  const double stride = std::max(kSmallSteps, reach) * stride_length(agent.definition.behaviour.speed);
  parts.gait_phase = wrap_angle(parts.gait_phase + direction * pace / stride * turn * dt);
  parts.gait_amplitude = towards(parts.gait_amplitude, reach, 3 * dt);
}

void observe_robot(Agent& agent, const StepClock& clock, Physics& physics,
                   std::vector<JointIncident>& incidents, std::vector<Event>& events) {
  agent.robot->observe(physics, clock.now(), clock.dt, incidents);
  for (const JointIncident& incident : incidents) {
    Event event = agent_event(incident.kind, agent, clock.now());
    event.object = incident.joint;
    event.value = incident.value;
    event.position = incident.position;
    events.push_back(std::move(event));
  }
  incidents.clear();
  agent.pose = planar_pose(agent.robot->motion().T_map_base);
  agent.floor = agent.rigid.T_map_body.translation().z();
  place_footprint(agent);
}

void observe_cable(Agent& agent, Physics& physics) {
  if (!agent.cable->observe(physics)) return;
  agent.pose = planar_pose(agent.rigid.T_map_body);
  std::vector<Eigen::Vector2d> corners;
  const double r = agent.cable->form().radius;
  for (const Eigen::Vector3d& p : agent.cable->points()) {
    for (int corner = 0; corner < 4; ++corner)
      corners.emplace_back(p.x() + (corner & 1 ? r : -r), p.y() + (corner & 2 ? r : -r));
  }
  agent.placed = make_polygon(convex_hull(std::move(corners)));
}

}  // namespace

void drive_agents(Agents& agents, const Surroundings& around, Behaviours& behaviours,
                  ContactForecast& forecast, Physics& physics, std::vector<Event>& events) {
  const double dt = around.clock.dt;
  for (Agent& agent : agents) {
    if (!agent.form.upright) continue;
    const SteeringLimits limits = limits_of(agent);
    const Twist2 twist =
        slowed_for_people(agent, behaviours.wanted(agent, around, events), around.environment.people);
    if (agent.robot) {
      agent.robot->drive(physics, agent.supply.empty ? Twist2{} : twist, around.clock.now(), dt);
      continue;
    }
    const bool walks = agent.definition.kind == AgentKind::person;
    agent.driven.vx =
        towards(agent.driven.vx, twist.vx, (twist.vx < agent.driven.vx ? 1.5 : 1) * limits.acceleration * dt);
    agent.driven.vy = walks ? towards(agent.driven.vy, twist.vy, limits.acceleration * dt) : 0;
    agent.driven.wz = towards(agent.driven.wz, twist.wz, limits.angular_acceleration * dt);
    if (decides(agent, around.clock))
      set_unconstrained(agent, !around.options.solve_all && forecast.untouchable(agent, around), physics);
    const double friction = walks ? 0.9 : 0.6;
    if (agent.unconstrained)
      Physics::drive(agent.rigid, agent.driven, friction, dt);
    else
      physics.drive(agent.handle, agent.driven, friction);
  }
}

void observe_agents(Agents& agents, const StepClock& clock, Physics& physics, std::vector<Event>& events) {
  std::vector<JointIncident> incidents;
  for (Agent& agent : agents) {
    if (agent.unconstrained) {
      move_unconstrained(agent, clock.dt);
      place(agent.form.footprint, agent.pose, agent.placed);
      move_parts(agent, clock.dt);
      continue;
    }
    const RigidState rigid = physics.state(agent.handle);
    const bool moved = !rigid.T_map_body.isometry().isApprox(agent.rigid.T_map_body.isometry(), 0);
    agent.rigid = rigid;
    if (agent.robot) {
      observe_robot(agent, clock, physics, incidents, events);
    } else if (agent.cable) {
      observe_cable(agent, physics);
    } else if (moved || agent.form.upright) {
      agent.pose = planar_pose(agent.rigid.T_map_body);
      place_footprint(agent);
      move_parts(agent, clock.dt);
    }
  }
}

}  // namespace parhelion::simulation
