#include "server/simulation/articulated_robot.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace parhelion {
namespace {

constexpr double kServo = 12;          // 1/s: how fast a position error is driven out
constexpr double kCourse = 0.1;        // share of its speed with which a joint goes back to its course
constexpr double kSpeedUp = 0.2;       // s from rest to a joint's full speed
constexpr double kCommandHolds = 0.5;  // s of velocities and efforts without a new command
constexpr double kStayAwake = 1.0;     // s after a command
constexpr double kLoadTime = 0.02;     // s over which what tears at a joint is averaged
constexpr double kStalled = 0.5;       // s at the limit without moving: an overload
constexpr double kBacklash = 0.004;    // rad or m by which geared joints differ before one has no force
constexpr double kAtLimit = 0.99;      // share of a motor's effort
constexpr double kYield = 3;           // a load slows a weak motor down this much faster than it speeds up
constexpr double kFreely = 1e3;        // m/s in a step: a wheel without motor goes as the ground does
constexpr double kStandstill = 0.02;   // m/s below which steering does not follow the curvature

double towards(double from, double to, double most) { return from + std::clamp(to - from, -most, most); }

Eigen::Isometry3d joint_motion(const RobotJoint& joint, double position) {
  if (joint.kind != JointKind::prismatic) return turn_about(joint.axis, position);
  return Eigen::Isometry3d(Eigen::Translation3d(position * joint.axis));
}

}  // namespace

ArticulatedRobot::ArticulatedRobot(std::shared_ptr<const RobotModel> model)
    : model_(std::move(model)), layout_(make_layout(*model_)) {
  servos_.resize(layout_.joints.size());
  gears_.resize(layout_.joints.size());
  for (std::size_t i = 0; i < gears_.size(); ++i) {
    const auto leader = model_->joints[layout_.joints[i].joint].geared;
    for (std::size_t other = 0; leader && other < gears_.size(); ++other) {
      if (layout_.joints[other].joint != *leader) continue;
      gears_[i] = Gear{other, true};
      gears_[other] = Gear{i, false};
    }
  }
  steering_.assign(model_->joints.size(), 0);
  for (const std::size_t joint : layout_.steering) motion_.joints.names.push_back(model_->joints[joint].name);
  for (const auto& joint : layout_.joints) motion_.joints.names.push_back(model_->joints[joint.joint].name);
  const std::size_t count = motion_.joints.names.size();
  motion_.joints.positions.assign(count, 0);
  motion_.joints.velocities.assign(count, 0);
  motion_.joints.efforts.assign(count, 0);
  motion_.broken.assign(count, false);
  start_again();
}

void ArticulatedRobot::start_again() {
  const std::size_t runners = layout_.runners.size();
  rolled_.assign(runners, 0);
  turned_.assign(runners, 0);
  runner_speed_.assign(runners, 0);
  for (const std::size_t joint : layout_.steering) steering_[joint] = model_->joints[joint].start;
  for (std::size_t i = 0; i < servos_.size(); ++i) {
    const RobotJoint& joint = model_->joints[layout_.joints[i].joint];
    servos_[i] = Servo{};
    servos_[i].target = joint.start;
    servos_[i].most_speed = joint.velocity;
  }
}

std::vector<Transform<Map, Body>> ArticulatedRobot::part_poses(const Transform<Map, Base>& T_map_base) const {
  std::vector<Transform<Map, Body>> poses(layout_.parts.size());
  poses[0] = Transform<Map, Body>(T_map_base.isometry());
  for (const RobotLayout::Joint& joint : layout_.joints) {
    const RobotJoint& its = model_->joints[joint.joint];
    const Eigen::Isometry3d T_a_b = joint.definition.T_a_joint *
                                    joint.definition.T_b_joint.inverse(Eigen::Isometry) *
                                    joint_motion(its, its.start);
    poses[joint.b] = Transform<Map, Body>(poses[joint.a].isometry() * T_a_b);
  }
  return poses;
}

void ArticulatedRobot::enter(Physics& physics, const Transform<Map, Base>& T_map_base) {
  handles_ = physics.add_parts(layout_.parts, part_poses(T_map_base));
  for (const RobotLayout::Joint& joint : layout_.joints) {
    JointDefinition definition = joint.definition;
    definition.a = handles_[joint.a];
    definition.b = handles_[joint.b];
    joint_handles_.push_back(physics.add_joint(definition));
  }
  put(physics, T_map_base);
}

void ArticulatedRobot::leave(Physics& physics) {
  for (const JointHandle joint : joint_handles_) physics.remove_joint(joint);
  for (const PhysicsHandle handle : handles_) physics.remove(handle);
}

void ArticulatedRobot::put(Physics& physics, const Transform<Map, Base>& T_map_base) {
  start_again();
  const auto poses = part_poses(T_map_base);
  parts_.resize(handles_.size());
  for (std::size_t i = 0; i < handles_.size(); ++i) {
    physics.teleport(handles_[i], poses[i]);
    parts_[i] = {poses[i], Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  }
  for (std::size_t i = 0; i < joint_handles_.size(); ++i) {
    physics.release_joint(joint_handles_[i], false);
    physics.restart_joint(joint_handles_[i], servos_[i].target);
  }
  motion_.T_map_base = T_map_base;
  motion_.velocity = motion_.rotation_rate = motion_.acceleration = Eigen::Vector3d::Zero();
  motion_.left = motion_.right = 0;
  motion_.touching.clear();
  ++motion_.epoch;
  awake_until_.reset();
}

void ArticulatedRobot::restore(Physics& physics) {
  const RobotMotion before = motion_;
  const auto rolled = rolled_, turned = turned_;
  // The parts are put together again where base_link is, and nothing is said of a jump.
  put(physics, motion_.T_map_base);
  rolled_ = rolled;
  turned_ = turned;
  motion_.left = before.left;
  motion_.right = before.right;
}

const std::string& ArticulatedRobot::link_name(PhysicsHandle handle, int shape) const {
  const auto part = static_cast<std::size_t>(handle - handles_.front());
  const auto& solids = layout_.solids[part];
  if (shape >= 0 && static_cast<std::size_t>(shape) < solids.size())
    return model_->links[solids[static_cast<std::size_t>(shape)].link].name;
  const auto first = std::find_if(layout_.nodes.begin(), layout_.nodes.end(),
                                  [&](const RobotNode& node) { return node.part == part; });
  return model_->links[first->link].name;
}

Status ArticulatedRobot::command(const Joints& joints, SimulationTime now) {
  const auto* values = !joints.positions.empty()    ? &joints.positions
                       : !joints.velocities.empty() ? &joints.velocities
                                                    : &joints.efforts;
  const Servo::Mode mode = values == &joints.positions    ? Servo::Mode::position
                           : values == &joints.velocities ? Servo::Mode::velocity
                                                          : Servo::Mode::effort;
  const std::string who = "robot model '" + model_->name + "': ";
  if (values->size() != joints.names.size()) {
    return Error{who + "a command of " + std::to_string(joints.names.size()) + " joints with " +
                 std::to_string(values->size()) + " values; expected one for each"};
  }
  if (!std::all_of(values->begin(), values->end(), [](double v) { return std::isfinite(v); }))
    return Error{who + "a joint command that is not finite"};
  std::string unknown;
  for (std::size_t n = 0; n < joints.names.size(); ++n) {
    const auto at = std::find_if(layout_.joints.begin(), layout_.joints.end(), [&](const auto& joint) {
      return model_->joints[joint.joint].name == joints.names[n];
    });
    if (at == layout_.joints.end()) {
      unknown += (unknown.empty() ? "'" : ", '") + joints.names[n] + "'";
      continue;
    }
    const auto index = static_cast<std::size_t>(at - layout_.joints.begin());
    if (gears_[index] && gears_[index]->follows) continue;
    Servo& servo = servos_[index];
    const RobotJoint& joint = model_->joints[at->joint];
    servo.mode = mode;
    servo.target = (*values)[n];
    servo.most_speed = joint.velocity;
    servo.until.reset();
    if (mode != Servo::Mode::position) servo.until = now + seconds(kCommandHolds);
    if (mode == Servo::Mode::position && joints.velocities.size() == joints.names.size() &&
        std::isfinite(joints.velocities[n]) && joints.velocities[n] > 0)
      servo.most_speed = std::min(joint.velocity, joints.velocities[n]);
    if (mode == Servo::Mode::position && at->definition.limited)
      servo.target = std::clamp(servo.target, joint.lower, joint.upper);
  }
  awake_until_ = now + seconds(kStayAwake);
  if (unknown.empty()) return {};
  std::string known;
  for (const auto& joint : layout_.joints)
    known += (known.empty() ? "" : ", ") + model_->joints[joint.joint].name;
  return Error{who + "no joint " + unknown + " can be commanded; it has " + (known.empty() ? "none" : known)};
}

void ArticulatedRobot::hold(const Physics& physics) {
  for (std::size_t i = 0; i < servos_.size(); ++i) {
    servos_[i].mode = Servo::Mode::position;
    servos_[i].target = physics.joint_state(joint_handles_[i]).position;
    servos_[i].until.reset();
  }
}

void ArticulatedRobot::drive(Physics& physics, const Twist2& wanted, SimulationTime now, double dt) {
  const bool idle = wanted.vx == 0 && wanted.wz == 0;
  if (!idle) awake_until_ = now + seconds(kStayAwake);
  physics.keep_awake(base(), awake_until_ && now <= *awake_until_);
  Twist2 twist = wanted;
  const RobotLimits& limits = model_->description.limits;
  twist.vx = std::clamp(twist.vx, -limits.speed, limits.speed);
  twist.wz = std::clamp(twist.wz, -limits.yaw_rate, limits.yaw_rate);
  drive_runners(physics, twist, dt);
  for (std::size_t i = 0; i < servos_.size(); ++i) drive_joint(physics, i, now, dt);
}

void ArticulatedRobot::drive_runners(Physics& physics, const Twist2& wanted, double dt) {
  const RobotDrive& drive = model_->drive;
  double curvature = 0;
  const bool ackermann = drive.kind == DriveKind::ackermann;
  if (ackermann) {
    const double speed = std::max(std::abs(wanted.vx), kStandstill);
    curvature = std::clamp(wanted.wz / std::copysign(speed, wanted.vx), layout_.least_curvature,
                           layout_.most_curvature);
    steer(physics, curvature, dt);
    // Of the angle that the wheels have now, not of the one that they go for.
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < drive.runners.size(); ++i) {
      if (!drive.runners[i].steering) continue;
      const double angle = steering_[*drive.runners[i].steering];
      const double y = layout_.runners[i].center.y();
      sum += std::tan(angle) / (drive.wheelbase + y * std::tan(angle));
      ++count;
    }
    curvature = count > 0 ? sum / count : 0;
  }
  for (std::size_t i = 0; i < drive.runners.size(); ++i) {
    const RobotRunner& runner = drive.runners[i];
    const RobotLayout::Runner& place = layout_.runners[i];
    double target = wanted.vx - wanted.wz * runner.side * drive.track / 2;
    if (ackermann) {
      const double along = 1 - curvature * place.center.y();
      const double across = runner.steering ? curvature * drive.wheelbase : 0;
      target = wanted.vx * std::copysign(std::hypot(along, across), along);
    }
    const double speed =
        runner.driven ? towards(runner_speed_[i], target, drive.acceleration * dt) : runner_speed_[i];
    const Eigen::Isometry3d T = T_part_node(place.node);
    // A wheel's own turn does not change where its axle points.
    const double yield = runner.driven ? kYield * drive.acceleration * dt : kFreely;
    physics.run(handles_[place.part], place.index,
                {speed, runner.driven ? drive.force : 0, yield, T.linear() * place.axis});
  }
}

/// Wheels that steer follow circles about one centre, which lies on the line of the fixed axle.
void ArticulatedRobot::steer(Physics& physics, double curvature, double dt) {
  for (const std::size_t joint : layout_.steering) {
    const RobotJoint& its = model_->joints[joint];
    double y = 0;
    for (std::size_t i = 0; i < model_->drive.runners.size(); ++i) {
      if (model_->drive.runners[i].steering == joint) y = layout_.runners[i].center.y();
    }
    const double wanted = std::atan2(curvature * model_->drive.wheelbase, 1 - curvature * y);
    const double before = steering_[joint];
    steering_[joint] = towards(before, std::clamp(wanted, its.lower, its.upper), its.velocity * dt);
    if (steering_[joint] == before) continue;
    for (std::size_t part = 0; part < layout_.solids.size(); ++part) {
      for (std::size_t shape = 0; shape < layout_.solids[part].size(); ++shape) {
        const RobotSolid& solid = layout_.solids[part][shape];
        if (solid.node == 0) continue;
        physics.move_shape(handles_[part], shape,
                           Transform<Body, ShapeFrame>(T_part_node(solid.node) * solid.T_node_shape));
      }
    }
  }
}

void ArticulatedRobot::drive_joint(Physics& physics, std::size_t i, SimulationTime now, double dt) {
  Servo& servo = servos_[i];
  const RobotJoint& joint = model_->joints[layout_.joints[i].joint];
  if (servo.broken) return;
  const JointState state = physics.joint_state(joint_handles_[i]);
  if (gears_[i] && gears_[i]->follows) {
    const Servo& leader = servos_[gears_[i]->other];
    servo.mode = leader.mode;
    servo.target = leader.target;
    servo.most_speed = leader.most_speed;
  }
  if (servo.until && now > *servo.until) {
    servo.until.reset();
    servo.mode = Servo::Mode::position;
    servo.target = servo.course.value_or(state.position);
  }
  if (servo.mode != Servo::Mode::velocity) servo.course.reset();
  if (servo.mode == Servo::Mode::effort) {
    const double effort = std::clamp(servo.target, -joint.effort, joint.effort);
    servo.asked = 0;
    // What drives without end in the direction of its effort has that effort.
    physics.drive_joint(joint_handles_[i], std::copysign(joint.velocity, effort),
                        std::abs(effort) * geared_share(physics, i, state.position, effort));
    return;
  }
  if (servo.mode == Servo::Mode::velocity) {
    servo.asked = keep_course(servo, joint, state.position, dt);
  } else {
    const double wanted =
        std::clamp(kServo * (servo.target - state.position), -servo.most_speed, servo.most_speed);
    servo.asked = towards(servo.asked, wanted, joint.velocity / kSpeedUp * dt);
  }
  if (std::abs(servo.asked) > 0.01 * joint.velocity) awake_until_ = std::max(awake_until_.value_or(now), now);
  const double share = geared_share(physics, i, state.position, servo.asked);
  physics.drive_joint(joint_handles_[i], servo.asked, share * (joint.effort + joint.friction));
}

/// A motor under load gives way a little: without a course an arm that is told to stand still would sink.
double ArticulatedRobot::keep_course(Servo& servo, const RobotJoint& joint, double position, double dt) {
  const double most = kCourse * joint.velocity;
  if (!servo.course) {
    const double correction = std::clamp(servo.asked, -most, most);
    servo.speed = servo.asked - correction;
    servo.course = position + correction / kServo;
  }
  // What stops the joint is not made up for afterwards.
  servo.course = position + std::clamp(*servo.course - position, -most / kServo, most / kServo);
  const double wanted = std::clamp(servo.target, -servo.most_speed, servo.most_speed);
  servo.speed = towards(servo.speed, wanted, joint.velocity / kSpeedUp * dt);
  const double asked = servo.speed + kServo * (*servo.course - position);
  *servo.course += servo.speed * dt;
  return std::clamp(asked, -joint.velocity, joint.velocity);
}

double ArticulatedRobot::geared_share(Physics& physics, std::size_t i, double position, double way) const {
  if (!gears_[i] || servos_[gears_[i]->other].broken) return 1;
  const double other = physics.joint_state(joint_handles_[gears_[i]->other]).position;
  const double ahead = std::copysign(1.0, way) * (position - other);
  return std::clamp(1 - ahead / kBacklash, 0.0, 1.0);
}

void ArticulatedRobot::observe(Physics& physics, SimulationTime, double dt,
                               std::vector<JointIncident>& incidents) {
  for (std::size_t i = 0; i < handles_.size(); ++i) parts_[i] = physics.state(handles_[i]);
  const RigidState& base_state = parts_[0];
  motion_.T_map_base = Transform<Map, Base>(base_state.T_map_body.isometry());
  motion_.acceleration = (base_state.velocity - motion_.velocity) / dt;
  motion_.velocity = base_state.velocity;
  motion_.rotation_rate = base_state.rotation_rate;
  motion_.touching.clear();
  double left = 0, right = 0;
  int lefts = 0, rights = 0;
  for (std::size_t i = 0; i < layout_.runners.size(); ++i) {
    const RobotRunner& runner = model_->drive.runners[i];
    runner_speed_[i] = physics.runner(handles_[layout_.runners[i].part], layout_.runners[i].index).speed;
    rolled_[i] += runner_speed_[i] * dt;
    if (runner.kind == RobotRunner::Kind::wheel)
      turned_[i] = wrap_angle(turned_[i] + runner_speed_[i] * dt / runner.radius);
    // Encoders are on what neither steers nor is carried by a joint.
    if (runner.steering || layout_.runners[i].part != 0) continue;
    (runner.side > 0 ? left : right) += rolled_[i];
    ++(runner.side > 0 ? lefts : rights);
  }
  motion_.left = left / std::max(1, lefts);
  motion_.right = right / std::max(1, rights);
  std::size_t n = 0;
  for (const std::size_t joint : layout_.steering) {
    motion_.joints.velocities[n] = (steering_[joint] - motion_.joints.positions[n]) / dt;
    motion_.joints.positions[n++] = steering_[joint];
  }
  for (std::size_t i = 0; i < servos_.size(); ++i, ++n) {
    watch_joint(physics, i, dt, incidents);
    const JointState state = physics.joint_state(joint_handles_[i]);
    motion_.joints.positions[n] = state.position;
    motion_.joints.velocities[n] = state.velocity;
    motion_.joints.efforts[n] = state.effort;
    motion_.broken[n] = servos_[i].broken;
  }
}

double ArticulatedRobot::drive_power(const Physics& physics) const {
  double power = 0;
  for (const RobotLayout::Runner& place : layout_.runners) {
    const RunnerMotion runner = physics.runner(handles_[place.part], place.index);
    power += std::max(0.0, runner.force * runner.speed);
  }
  return power;
}

double ArticulatedRobot::mass() const {
  double sum = 0;
  for (const PartDefinition& part : layout_.parts) sum += part.mass;
  return sum;
}

void ArticulatedRobot::watch_joint(Physics& physics, std::size_t i, double dt,
                                   std::vector<JointIncident>& incidents) {
  Servo& servo = servos_[i];
  const RobotJoint& joint = model_->joints[layout_.joints[i].joint];
  if (servo.broken) return;
  const JointState state = physics.joint_state(joint_handles_[i]);
  const Eigen::Vector3d place = parts_[layout_.joints[i].b].T_map_body.translation();
  servo.load += (state.load - servo.load) * std::min(1.0, dt / kLoadTime);
  if (joint.break_effort > 0 && servo.load > joint.break_effort) {
    servo.broken = true;
    physics.release_joint(joint_handles_[i], true);
    incidents.push_back({EventKind::joint_broken, joint.name, servo.load, place});
    return;
  }
  const bool holds = std::find(model_->gripper.begin(), model_->gripper.end(),
                               model_->links[joint.child].name) != model_->gripper.end();
  if (holds || !(joint.effort > 0)) return;  // fingers push with all they have: that is how they hold
  const double share = std::abs(state.effort) / joint.effort;
  const bool still = std::abs(state.velocity) < 0.05 * joint.velocity;
  servo.stalled = share >= kAtLimit && still ? servo.stalled + dt : 0;
  if (servo.stalled > kStalled && !servo.overloaded) {
    servo.overloaded = true;
    incidents.push_back({EventKind::joint_overload, joint.name, share, place});
  }
  if (share < 0.9) servo.overloaded = false;
}

Eigen::Isometry3d ArticulatedRobot::T_part_node(std::size_t index) const {
  const RobotNode& node = layout_.nodes[index];
  if (!node.parent) return Eigen::Isometry3d::Identity();
  double angle = 0;
  if (node.steering) angle = steering_[*node.steering];
  if (node.runner) {
    const Eigen::Vector3d axis = layout_.runners[*node.runner].axis;
    angle = turned_[*node.runner] * (axis.dot(node.axis) < 0 ? -1 : 1);
  }
  return T_part_node(*node.parent) * node.T_parent_node * turn_about(node.axis, angle);
}

std::vector<BodyDefinition> ArticulatedRobot::bodies(const std::string& entity, BodyId first,
                                                     BodyOwner owner) const {
  std::vector<BodyDefinition> bodies;
  for (const RobotNode& node : layout_.nodes) {
    bodies.push_back(
        {first++, entity, model_->links[node.link].name, owner, owner == BodyOwner::agent, node.visible});
  }
  return bodies;
}

void ArticulatedRobot::append_states(BodyId first, std::uint32_t epoch,
                                     std::vector<BodyState>& bodies) const {
  for (std::size_t i = 0; i < layout_.nodes.size(); ++i) {
    const RobotNode& node = layout_.nodes[i];
    const RigidState& part = parts_[node.part];
    BodyState state;
    state.id = first + static_cast<BodyId>(i);
    state.epoch = epoch;
    state.T_map_body = Transform<Map, Body>(part.T_map_body.isometry() * T_part_node(i));
    const Eigen::Vector3d arm = state.T_map_body.translation() - part.T_map_body.translation();
    state.velocity = part.velocity + part.rotation_rate.cross(arm);
    state.rotation_rate = part.rotation_rate;
    if (node.runner) {
      const RobotRunner& runner = model_->drive.runners[*node.runner];
      state.rotation_rate += state.T_map_body.rotation() * layout_.runners[*node.runner].axis *
                             (runner_speed_[*node.runner] / runner.radius);
    }
    bodies.push_back(state);
  }
}

Eigen::Vector3d ArticulatedRobot::gripper_center() const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t link = 0; link < model_->links.size(); ++link) {
    const RobotLink& its = model_->links[link];
    if (std::find(model_->gripper.begin(), model_->gripper.end(), its.name) == model_->gripper.end())
      continue;
    const std::size_t node = layout_.node_of_link[link];
    sum += parts_[layout_.nodes[node].part].T_map_body.isometry() * T_part_node(node) *
           layout_.T_node_link[link] * its.center;
  }
  return sum / static_cast<double>(std::max<std::size_t>(1, model_->gripper.size()));
}

void ArticulatedRobot::touched(const std::string& link) {
  const auto& bumpers = model_->bumpers;
  const auto at = std::find(bumpers.begin(), bumpers.end(), link);
  if (at == bumpers.end()) return;
  const auto before = [&](const std::string& a, const std::string& b) {
    return std::find(bumpers.begin(), bumpers.end(), a) < std::find(bumpers.begin(), bumpers.end(), b);
  };
  auto& touching = motion_.touching;
  const auto place = std::lower_bound(touching.begin(), touching.end(), link, before);
  if (place == touching.end() || *place != link) touching.insert(place, link);
}

}  // namespace parhelion
