#include "server/simulation/bodies/real_robot.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/simulation/bodies/bodies.hpp"
#include "server/simulation/robots/base_body.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kZoneSpacing = 0.10;  // m between two footprints of the area

}  // namespace

std::size_t count_bodies(const RobotModel* model) {
  return model == nullptr ? 1 : make_layout(*model).nodes.size();
}

bool owns(const RealRobot& robot, PhysicsHandle handle) {
  return robot.twin ? robot.twin->owns(handle) : robot.handle == handle;
}

RealRobot make_real_robot(const RobotDescription& description, std::shared_ptr<const RobotModel> model,
                          std::size_t index, BodyId id, Physics& physics) {
  RealRobot robot;
  robot.name = description.name;
  robot.index = index;
  robot.id = id;
  robot.mass = description.mass;
  robot.height = description.height;
  robot.limits = description.limits;
  robot.footprint = make_polygon(convex_hull(description.footprint));
  robot.watch = BodyWatch(supervised(description));
  robot.payload = description.payload;
  if (model) {
    if (robot.payload == 0) robot.payload = model->description.payload;
    robot.twin = std::make_unique<RobotTwin>(std::move(model));
    robot.twin->enter(physics);
    robot.handle = robot.twin->base();
    robot.definitions = robot.twin->bodies(description.name, id);
    return robot;
  }
  robot.handle = physics.add_kinematic(robot.footprint.vertices, robot.height);
  robot.definitions.push_back(std::make_shared<const BodyDefinition>(
      BodyDefinition{id, description.name, "base", BodyOwner::real_robot, false,
                     outline_shapes(robot.footprint.vertices, robot.height)}));
  return robot;
}

bool finite(const Twist2& twist) {
  return std::isfinite(twist.vx) && std::isfinite(twist.vy) && std::isfinite(twist.wz);
}

bool is_known(const std::optional<RealRobotState>& state) {
  return state && state->T_map_base.finite() && finite(state->twist);
}

double stopping_distance(const RobotLimits& limits, double speed, double later) {
  return speed * (limits.reaction_time + later) + speed * speed / (2 * limits.deceleration);
}

void append_stop_zone(const RealRobot& robot, const RealRobotState& now, std::vector<Footprint>& zone,
                      double later) {
  const Pose2 pose = planar_pose(now.T_map_base);
  const double speed = fastest_point_speed(robot.footprint, now.twist);
  const double braking_distance = stopping_distance(robot.limits, speed, later);
  const int steps = static_cast<int>(std::min(1000.0, std::ceil(braking_distance / kZoneSpacing)));
  for (int i = 0; i <= steps; ++i) {
    const double t = steps > 0 ? braking_distance / speed * i / steps : 0;
    Footprint footprint;
    place(robot.footprint, advance(pose, now.twist, t), footprint);
    footprint.radius += kStopMargin;
    footprint.bound += kStopMargin;
    zone.push_back(std::move(footprint));
  }
}

void place_real_robot(RealRobot& robot, const RealRobotState& now, bool jumped) {
  robot.last = now;
  if (now.relocalized) robot.last.twist = {};
  robot.present = robot.ever_present = true;
  robot.touchable = !jumped;
  robot.jumped = jumped;
  robot.injection_live = now.injection_live;
  place(robot.footprint, planar_pose(now.T_map_base), robot.placed);
}

namespace {

RigidState base_motion(const RealRobot& robot) {
  const Eigen::Isometry3d& base = robot.last.T_map_base.isometry();
  const Twist2& twist = robot.last.twist;
  return {body_of(robot.last.T_map_base), base.linear() * Eigen::Vector3d(twist.vx, twist.vy, 0),
          base.linear() * Eigen::Vector3d(0, 0, twist.wz)};
}

}  // namespace

void move_real_body(RealRobot& robot, Physics& physics) {
  const RigidState base = base_motion(robot);
  if (robot.twin) return robot.twin->move(physics, base, robot.touchable);
  physics.suspend(robot.handle, !robot.touchable);
  physics.move_kinematic(robot.handle, base.T_map_body, base.velocity, base.rotation_rate);
}

void append_states(const RealRobot& robot, std::vector<BodyState>& bodies) {
  if (!robot.present) return;
  const std::size_t first = bodies.size();
  if (robot.twin) {
    robot.twin->append_states(robot.id, robot.epoch, bodies);
  } else {
    const RigidState base = base_motion(robot);
    bodies.push_back({robot.id, robot.epoch, base.T_map_body, base.velocity, base.rotation_rate, true});
  }
  for (std::size_t i = first; i < bodies.size(); ++i) bodies[i].attitude_known = robot.last.attitude_known;
}

void suspend_real_robot(RealRobot& robot, Physics& physics) {
  robot.present = robot.touchable = robot.injection_live = false;
  if (robot.twin) return robot.twin->suspend(physics);
  physics.suspend(robot.handle, true);
}

}  // namespace parhelion::simulation
