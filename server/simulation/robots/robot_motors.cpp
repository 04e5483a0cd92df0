// Motor control of an articulated robot, and the loads on its motors.
#include <algorithm>
#include <cmath>

#include "protocols/driving_timing.hpp"
#include "server/simulation/robots/articulated_robot.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kServo = 12;         // 1/s: gain of the position control
constexpr double kCourse = 0.1;       // fraction of its speed with which a joint corrects its position
constexpr double kSpeedUp = 0.2;      // s from rest to a joint's full speed
constexpr double kStayAwake = 1.0;    // s after a command
constexpr double kLoadTime = 0.02;    // s over which a joint's load is averaged
constexpr double kStalled = 0.5;      // s at the limit without motion: an overload
constexpr double kBacklash = 0.004;   // rad or m of difference at which a geared joint has no force left
constexpr double kAtLimit = 0.99;     // fraction of a motor's effort
constexpr double kYield = 3;          // ratio of a weak motor's deceleration under load to its acceleration
constexpr double kFreely = 1e3;       // m/s in a step: a wheel without motor moves with the ground
constexpr double kStandstill = 0.02;  // m/s below which steering does not follow the curvature

double towards(double from, double to, double max_step) {
  return from + std::clamp(to - from, -max_step, max_step);
}

}  // namespace

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
    servo.max_speed = joint.velocity;
    servo.until.reset();
    if (mode != Servo::Mode::position) servo.until = now + driving_timing::kTeleopSilence;
    if (mode == Servo::Mode::position && joints.velocities.size() == joints.names.size() &&
        std::isfinite(joints.velocities[n]) && joints.velocities[n] > 0)
      servo.max_speed = std::min(joint.velocity, joints.velocities[n]);
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

void ArticulatedRobot::block_sides(bool left, bool right) {
  left_blocked_ = left;
  right_blocked_ = right;
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
    curvature =
        std::clamp(wanted.wz / std::copysign(speed, wanted.vx), layout_.min_curvature, layout_.max_curvature);
    steer(physics, curvature, dt);
    // From the current angle of the wheels, not the commanded one.
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
    const bool blocked = runner.side > 0 ? left_blocked_ : right_blocked_;
    if (blocked) target = 0;
    const double speed =
        runner.driven ? towards(runner_speed_[i], target, drive.acceleration * dt) : runner_speed_[i];
    const Eigen::Isometry3d T = T_part_node(place.node);
    // A wheel's own rotation does not change the direction of its axle.
    const double yield = runner.driven ? kYield * drive.acceleration * dt : kFreely;
    physics.run(handles_[place.part], place.index,
                {speed, runner.driven ? drive.force : 0, yield, T.linear() * place.axis});
  }
}

/// Steered wheels follow circles about one centre, on the line of the fixed axle.
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
    const Gear& gear = *gears_[i];
    servo.mode = leader.mode;
    servo.max_speed = std::abs(gear.ratio) * leader.max_speed;
    servo.target = leader.mode == Servo::Mode::effort
                       ? std::copysign(leader.target, leader.target * gear.ratio)
                       : gear.ratio * leader.target;
    if (leader.mode == Servo::Mode::position) servo.target += gear.offset;
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
    // An effort is commanded as an unreachable speed with this effort as limit.
    physics.drive_joint(joint_handles_[i], std::copysign(joint.velocity, effort),
                        std::abs(effort) * geared_fraction(physics, i, state, effort, dt));
    return;
  }
  if (servo.mode == Servo::Mode::velocity) {
    servo.asked = keep_course(servo, joint, state.position, dt);
  } else {
    const double wanted =
        std::clamp(kServo * (servo.target - state.position), -servo.max_speed, servo.max_speed);
    servo.asked = towards(servo.asked, wanted, joint.velocity / kSpeedUp * dt);
  }
  if (std::abs(servo.asked) > 0.01 * joint.velocity) awake_until_ = std::max(awake_until_.value_or(now), now);
  const double fraction = geared_fraction(physics, i, state, servo.asked, dt);
  physics.drive_joint(joint_handles_[i], servo.asked, fraction * (joint.effort + joint.friction));
}

/// Motors under load yield a little: without position correction an arm commanded to stay would sink.
double ArticulatedRobot::keep_course(Servo& servo, const RobotJoint& joint, double position, double dt) {
  const double max_step = kCourse * joint.velocity;
  if (!servo.course) {
    const double correction = std::clamp(servo.asked, -max_step, max_step);
    servo.speed = servo.asked - correction;
    servo.course = position + correction / kServo;
  }
  // The position lost to an obstacle is not recovered afterwards.
  servo.course = position + std::clamp(*servo.course - position, -max_step / kServo, max_step / kServo);
  const double wanted = std::clamp(servo.target, -servo.max_speed, servo.max_speed);
  servo.speed = towards(servo.speed, wanted, joint.velocity / kSpeedUp * dt);
  const double asked = servo.speed + kServo * (*servo.course - position);
  *servo.course += servo.speed * dt;
  return std::clamp(asked, -joint.velocity, joint.velocity);
}

/// Uses the positions after the step: with current ones the joints would oscillate against each other.
double ArticulatedRobot::geared_fraction(Physics& physics, std::size_t i, const JointState& state,
                                         double direction, double dt) const {
  if (!gears_[i] || servos_[gears_[i]->other].broken) return 1;
  const JointState other = physics.joint_state(joint_handles_[gears_[i]->other]);
  const Gear& gear = *gears_[i];
  const double apart = state.position - (gear.ratio * other.position + gear.offset) +
                       (state.velocity - gear.ratio * other.velocity) * dt;
  const double backlash = kBacklash * std::max(1.0, std::abs(gear.ratio));
  return std::clamp(1 - std::copysign(1.0, direction) * apart / backlash, 0.0, 1.0);
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
  if (holds || !(joint.effort > 0)) return;  // gripper links push with their full effort, by design
  const double fraction = std::abs(state.effort) / joint.effort;
  const bool still = std::abs(state.velocity) < 0.05 * joint.velocity;
  servo.stalled = fraction >= kAtLimit && still ? servo.stalled + dt : 0;
  if (servo.stalled > kStalled && !servo.overloaded) {
    servo.overloaded = true;
    incidents.push_back({EventKind::joint_overload, joint.name, fraction, place});
  }
  if (fraction < 0.9) servo.overloaded = false;
}

}  // namespace parhelion::simulation
