#include "server/simulation/arm_travel.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "server/simulation/robots/base_body.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kContact = 0.001;  // m: a smaller distance is contact
constexpr double kProbe = 0.003;    // m of test motion that shows whether it leads out of a contact
constexpr int kMaxAdvances = 200;

/// The moving parts as a function of time.
struct Sweep {
  const RealRobot& robot;
  const Agents& agents;
  const Physics& physics;
  std::vector<std::size_t> parts;  // that move
  bool moves_grip = false;         // the gripper moves, with what it holds
  double speed = 0;                // m/s: no point is faster
  std::function<void(double, std::vector<Transform<Map, Body>>&)> place;
};

std::vector<Physics::Placed> bodies_of(const Agent& agent, const Physics& physics) {
  if (agent.cable) return {};
  if (!agent.robot) return {{agent.handle, agent.rigid.T_map_body}};
  std::vector<Physics::Placed> bodies;
  for (PhysicsHandle handle = agent.robot->base(); agent.robot->owns(handle); ++handle)
    bodies.push_back({handle, physics.state(handle).T_map_body});
  return bodies;
}

/// m between what moves and the agent, with the parts at these poses.
double gap(const Sweep& sweep, const std::vector<Transform<Map, Body>>& T_map_part, const Agent& agent,
           const std::vector<Physics::Placed>& bodies, double limit) {
  const RobotTwin& twin = *sweep.robot.twin;
  const RealGrip& grip = sweep.robot.grip;
  const bool is_around = grip.is_around(agent.definition.name);
  double nearest = limit;
  for (const Physics::Placed& body : bodies) {
    for (const std::size_t part : sweep.parts) {
      if (is_around && twin.is_finger(part)) continue;
      nearest =
          std::min(nearest, sweep.physics.distance({twin.handles()[part], T_map_part[part]}, body, nearest));
    }
    const Agent* held = sweep.moves_grip ? sweep.agents.find(grip.held()) : nullptr;
    if (held != nullptr && held != &agent)
      nearest = std::min(
          nearest, sweep.physics.distance({held->handle, grip.held_at(twin, T_map_part)}, body, nearest));
  }
  return nearest;
}

/// Conservative advancement: the gap closes no faster than the fastest point moves, so each advance by the
/// gap is safe.
double travel_to(const Sweep& sweep, const Agent& agent, double horizon) {
  const auto bodies = bodies_of(agent, sweep.physics);
  std::vector<Transform<Map, Body>> poses;
  const auto gap_at = [&](double t) {
    sweep.place(t, poses);
    return gap(sweep, poses, agent, bodies, sweep.speed * horizon + kContact + kProbe);
  };
  const double now = gap_at(0);
  if (now <= kContact) {
    const bool leads_out = gap_at(std::min(horizon, kProbe / sweep.speed)) > now + 1e-5;
    return leads_out ? horizon : 0;
  }
  double t = now / sweep.speed;
  for (int n = 0; n < kMaxAdvances && t < horizon; ++n) {
    const double left = gap_at(t);
    if (left <= kContact) return t;
    t += left / sweep.speed;
  }
  return std::min(t, horizon);
}

ArmTravel travel(const Sweep& sweep, double horizon) {
  ArmTravel result{horizon, {}};
  if (!(sweep.speed > 0) || sweep.parts.empty()) return result;
  std::vector<Transform<Map, Body>> poses;
  sweep.place(0, poses);
  const Eigen::Vector2d base = poses.front().translation().head<2>();
  const double reach = sweep.robot.twin->reach() + sweep.speed * horizon;
  for (const Agent& agent : sweep.agents) {
    const std::string& name = agent.definition.name;
    const bool is_near = (agent.placed.center - base).norm() - agent.placed.bound < reach;
    if (!is_near || name == sweep.robot.grip.held()) continue;
    const double time = travel_to(sweep, agent, result.time);
    if (time < result.time) result = {time, name};
  }
  return result;
}

double position_at(double from, const JointMotion& motion, double t) {
  const double moved = from + motion.velocity * t;
  if (!motion.target) return moved;
  return motion.velocity < 0 ? std::max(moved, *motion.target) : std::min(moved, *motion.target);
}

bool moves_finger(const RobotTwin& twin, std::size_t joint) {
  return std::any_of(twin.fingers().begin(), twin.fingers().end(),
                     [&](const TwinFinger& finger) { return twin.moves(joint, finger.part); });
}

/// Fingers that already press on a thing do not close further.
bool squeezes(const Sweep& sweep, double horizon) {
  const RobotTwin& twin = *sweep.robot.twin;
  const auto forces = sweep.robot.grip.forces();
  const Agent* thing = forces.empty() ? nullptr : sweep.agents.find(*forces.front().load);
  if (thing == nullptr) return false;
  std::vector<Transform<Map, Body>> now, then;
  sweep.place(0, now);
  sweep.place(std::min(horizon, kProbe / sweep.speed), then);
  const auto is = pinch(twin, now, *thing), will_be = pinch(twin, then, *thing);
  return is && will_be && will_be->gap < is->gap - 1e-6 && is->gap <= is->width + RealGrip::kTouch;
}

}  // namespace

ArmTravel joint_travel(const RealRobot& robot, const Agents& agents, const Physics& physics,
                       const std::vector<JointMotion>& motions, double horizon) {
  const RobotTwin& twin = *robot.twin;
  const std::vector<double>& from = twin.posture().positions;
  Sweep sweep{robot, agents, physics, {}, false, 0, {}};
  for (const JointMotion& motion : motions)
    sweep.speed += twin.reach(motion.joint) * std::abs(motion.velocity);
  for (std::size_t part = 0; part < twin.handles().size(); ++part) {
    const bool moved = std::any_of(motions.begin(), motions.end(), [&](const JointMotion& motion) {
      return motion.velocity != 0 && twin.moves(motion.joint, part);
    });
    if (!moved) continue;
    sweep.parts.push_back(part);
    sweep.moves_grip = sweep.moves_grip || twin.is_finger(part);
  }
  sweep.place = [&](double t, std::vector<Transform<Map, Body>>& poses) {
    std::vector<double> positions = from;
    for (const JointMotion& motion : motions)
      positions[motion.joint] = position_at(from[motion.joint], motion, t);
    twin.follow_leaders(positions, false);
    twin.place(robot.last.T_map_base, positions, poses);
  };
  const bool grips = std::any_of(motions.begin(), motions.end(), [&](const JointMotion& motion) {
    return motion.velocity != 0 && moves_finger(twin, motion.joint);
  });
  if (grips && sweep.speed > 0 && squeezes(sweep, horizon)) return {0, *robot.grip.forces().front().load};
  return travel(sweep, horizon);
}

ArmTravel base_travel(const RealRobot& robot, const Agents& agents, const Physics& physics,
                      const Transform<Map, Base>& T_map_base, const Twist2& twist, double horizon) {
  const RobotTwin& twin = *robot.twin;
  Sweep sweep{robot, agents, physics, {}, true, 0, {}};
  sweep.speed = std::hypot(twist.vx, twist.vy) + std::abs(twist.wz) * twin.reach();
  for (std::size_t part = 1; part < twin.handles().size(); ++part) sweep.parts.push_back(part);
  const Pose2 start = planar_pose(T_map_base);
  sweep.place = [&](double t, std::vector<Transform<Map, Body>>& poses) {
    const Pose2 moved = advance(start, twist, t);
    const double turned = moved.yaw - start.yaw;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = Eigen::AngleAxisd(turned, Eigen::Vector3d::UnitZ()) * T_map_base.rotation();
    T.translation() = T_map_base.translation() + Eigen::Vector3d(moved.x - start.x, moved.y - start.y, 0);
    twin.place(Transform<Map, Base>(T), twin.posture().positions, poses);
  };
  return travel(sweep, horizon);
}

}  // namespace parhelion::simulation
