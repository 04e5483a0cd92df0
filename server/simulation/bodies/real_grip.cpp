#include "server/simulation/bodies/real_grip.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "protocols/gravity.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kPadFraction = 0.8;  // of the pads' half size: lines near their edges
constexpr double kRelieved = 0.95;    // of a joint's effort: below it an overload has ended
constexpr double kNear = 3;           // m: farther things are not looked at

struct Interval {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  double middle() const { return (low + high) / 2; }
  double half() const { return (high - low) / 2; }
};

Interval cut(const Interval& a, const Interval& b) {
  return {std::max(a.low, b.low), std::min(a.high, b.high)};
}

/// The gripper's frame: origin in the middle between the fingers' centres, x from one finger to the other.
struct GripFrame {
  Eigen::Isometry3d T_map_grip = Eigen::Isometry3d::Identity();
  std::array<std::vector<Eigen::Vector3d>, 2> corners;  // of the fingers, m, grip frame
};

Eigen::Vector3d mean(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

GripFrame grip_frame(const RobotTwin& twin, const std::vector<Transform<Map, Body>>& T_map_part) {
  GripFrame frame;
  for (std::size_t i = 0; i < 2; ++i) {
    const TwinFinger& finger = twin.fingers()[i];
    for (const Eigen::Vector3d& corner : finger.corners)
      frame.corners[i].push_back(T_map_part[finger.part] * corner);
  }
  const Eigen::Vector3d a = mean(frame.corners[0]), b = mean(frame.corners[1]);
  const Eigen::Matrix3d R = T_map_part[twin.fingers().front().part].rotation();
  const Eigen::Vector3d along = (b - a).norm() > 1e-9 ? Eigen::Vector3d((b - a).normalized()) : R.col(1);
  // The axis after the one that is most along: of the two across, neither is nearer by more than rounding.
  Eigen::Index nearest = 0;
  (R.transpose() * along).cwiseAbs().maxCoeff(&nearest);
  const Eigen::Vector3d across = R.col((nearest + 1) % 3);
  const Eigen::Vector3d y = (across - along * along.dot(across)).normalized();
  frame.T_map_grip.linear() << along, y, along.cross(y);
  frame.T_map_grip.translation() = (a + b) / 2;
  const Eigen::Isometry3d T_grip_map = frame.T_map_grip.inverse(Eigen::Isometry);
  for (auto& corners : frame.corners)
    for (Eigen::Vector3d& corner : corners) corner = T_grip_map * corner;
  return frame;
}

Interval extent(const std::vector<Eigen::Vector3d>& points, int axis) {
  Interval its{points.front()[axis], points.front()[axis]};
  for (const Eigen::Vector3d& p : points) its = {std::min(its.low, p[axis]), std::max(its.high, p[axis])};
  return its;
}

Interval within_slab(double from, double along, const Interval& slab) {
  if (std::abs(along) < 1e-9) return from >= slab.low && from <= slab.high ? Interval{} : Interval{1, 0};
  const double a = (slab.low - from) / along, b = (slab.high - from) / along;
  return {std::min(a, b), std::max(a, b)};
}

Interval within_circle(const Eigen::Vector2d& from, const Eigen::Vector2d& along, double radius) {
  const double a = along.squaredNorm(), b = from.dot(along), c = from.squaredNorm() - radius * radius;
  if (a < 1e-12) return c <= 0 ? Interval{} : Interval{1, 0};
  const double root = b * b - a * c;
  if (root < 0) return {1, 0};
  return {(-b - std::sqrt(root)) / a, (-b + std::sqrt(root)) / a};
}

/// Where the line is inside the thing, whose origin is at the middle of its underside; low > high: nowhere.
Interval chord(const Eigen::Vector3d& from, const Eigen::Vector3d& along, const AgentForm& form) {
  const Eigen::Vector3d half = form.size / 2;
  const Interval upright = within_slab(from.z(), along.z(), {0, form.size.z()});
  if (form.shape == ShapeKind::cylinder)
    return cut(upright, within_circle(from.head<2>(), along.head<2>(), half.x()));
  return cut(upright, cut(within_slab(from.x(), along.x(), {-half.x(), half.x()}),
                          within_slab(from.y(), along.y(), {-half.y(), half.y()})));
}

Eigen::Vector3d turn_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
  const Eigen::AngleAxisd turn(to * from.transpose());
  return turn.angle() * turn.axis();
}

std::vector<Transform<Map, Body>> poses_of(const RobotTwin& twin) {
  std::vector<Transform<Map, Body>> poses;
  for (const RigidState& part : twin.parts()) poses.push_back(part.T_map_body);
  return poses;
}

Event event_of(EventKind kind, const std::string& robot, const std::string& object, double value,
               const Eigen::Vector3d& position, SimulationTime now) {
  Event event;
  event.stamp = now;
  event.kind = kind;
  event.subject = robot;
  event.object = object;
  event.pair = PairKind::real_virtual;
  event.position = position;
  event.value = value;
  return event;
}

}  // namespace

bool is_grippable(const Agent& agent) { return !agent.robot && !agent.form.upright && !agent.cable; }

std::optional<Pinch> pinch(const RobotTwin& twin, const std::vector<Transform<Map, Body>>& T_map_part,
                           const Agent& thing) {
  const GripFrame frame = grip_frame(twin, T_map_part);
  Interval pads[2];
  for (const int axis : {1, 2}) {
    pads[axis - 1] = cut(extent(frame.corners[0], axis), extent(frame.corners[1], axis));
    if (!(pads[axis - 1].half() > 0)) return std::nullopt;
  }
  const Eigen::Isometry3d T_thing_grip =
      thing.rigid.T_map_body.isometry().inverse(Eigen::Isometry) * frame.T_map_grip;
  const Eigen::Vector3d along = T_thing_grip.linear().col(0);
  Interval thick{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  constexpr std::array<std::array<double, 2>, 5> kLines{{{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  for (const auto& [y, z] : kLines) {
    const Eigen::Vector3d from(0, pads[0].middle() + kPadFraction * y * pads[0].half(),
                               pads[1].middle() + kPadFraction * z * pads[1].half());
    const Interval inside = chord(T_thing_grip * from, along, thing.form);
    if (inside.low >= inside.high) continue;
    thick = {std::min(thick.low, inside.low), std::max(thick.high, inside.high)};
  }
  if (thick.low >= thick.high) return std::nullopt;
  const double near = extent(frame.corners[0], 0).high, far = extent(frame.corners[1], 0).low;
  return Pinch{far - near, thick.high - thick.low, near < thick.middle() && thick.middle() < far};
}

Eigen::Vector3d RealGrip::center(const RobotTwin& twin) {
  return grip_frame(twin, poses_of(twin)).T_map_grip.translation();
}

Transform<Map, Body> RealGrip::held_at(const RobotTwin& twin,
                                       const std::vector<Transform<Map, Body>>& T_map_part) const {
  return Transform<Map, Body>(grip_frame(twin, T_map_part).T_map_grip * T_grip_thing_);
}

void RealGrip::release(const Agent* thing, Physics& physics) {
  if (thing != nullptr) {
    physics.move_held(thing->handle, Physics::Carried::no);
    if (!held_.empty()) physics.set_velocity(thing->handle, motion_.velocity, motion_.rotation_rate);
  }
  held_.clear();
  wanted_.reset();
  too_heavy_.clear();
  overloaded_.clear();
  force_ = 0;
}

void RealGrip::release(Agents& agents, Physics& physics) {
  release(agents.find(held_.empty() ? too_heavy_ : held_), physics);
  around_.clear();
}

void RealGrip::move_held(const RobotTwin& twin, bool present, bool jumped, Agents& agents, Physics& physics,
                         double dt) {
  if (held_.empty()) return;
  Agent* thing = agents.find(held_);
  if (thing == nullptr || thing->epoch != epoch_) return release(thing, physics);
  const RigidState is = physics.state(thing->handle);
  motion_ = {};
  if (!present) return physics.set_velocity(thing->handle, {0, 0, 0}, {0, 0, 0});
  const Transform<Map, Body> wanted = held_at(twin, poses_of(twin));
  if (jumped) {
    wanted_ = wanted;
    physics.set_motion(thing->handle, {wanted, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
    return physics.move_held(thing->handle, Physics::Carried::held);  // a body that was put somewhere sleeps
  }
  const RigidState& finger = twin.parts()[twin.fingers().front().part];
  motion_.rotation_rate = finger.rotation_rate;
  motion_.velocity =
      finger.velocity +
      finger.rotation_rate.cross(Eigen::Vector3d(wanted.translation() - finger.T_map_body.translation()));
  const Eigen::Vector3d travel = wanted.translation() - is.T_map_body.translation();
  // Behind where the gripper has been, not where new encoders put it at once.
  const bool slips = wanted_ && (wanted_->translation() - is.T_map_body.translation()).norm() > kSlip;
  wanted_ = wanted;
  if (slips) return release(thing, physics);
  physics.set_velocity(thing->handle, travel / dt,
                       turn_between(is.T_map_body.rotation(), wanted.rotation()) / dt);
}

void RealGrip::look(const RobotTwin& twin, const Agents& agents) {
  around_.clear();
  const Eigen::Vector3d pads = center(twin);
  for (const Agent& agent : agents) {
    if (!is_grippable(agent) || (agent.rigid.T_map_body.translation() - pads).norm() > kNear) continue;
    const auto its = pinch(twin, poses_, agent);
    if (!its || !its->between || its->gap <= its->width + kTouch) continue;
    around_ = agent.definition.name;
    return;
  }
}

void RealGrip::take(const GripStep& step, const Agent& thing) {
  const double mass = thing.form.mass;
  epoch_ = thing.epoch;
  force_ = std::max(GripperWatch::kPinch, mass * kGravity);
  if (step.payload > 0 && mass > step.payload) {
    too_heavy_ = thing.definition.name;
    step.physics.move_held(thing.handle, Physics::Carried::slipping);
    step.events.push_back(event_of(EventKind::payload_exceeded, step.robot, too_heavy_, mass / step.payload,
                                   thing.rigid.T_map_body.translation(), step.now));
    return;
  }
  held_ = thing.definition.name;
  T_grip_thing_ =
      grip_frame(step.twin, poses_).T_map_grip.inverse(Eigen::Isometry) * thing.rigid.T_map_body.isometry();
  step.physics.move_held(thing.handle, Physics::Carried::held);
}

void RealGrip::watch_load(const GripStep& step, const Agent& thing) {
  const Eigen::Vector3d center = thing.rigid.T_map_body * Eigen::Vector3d(0, 0, thing.form.size.z() / 2);
  for (const std::size_t joint : step.twin.encoded()) {
    const RobotJoint& its = step.twin.model().joints[joint];
    const double load = step.twin.bears(joint, thing.form.mass, center) / its.effort;
    const auto known = std::find(overloaded_.begin(), overloaded_.end(), its.name);
    if (load > 1 && known == overloaded_.end()) {
      overloaded_.push_back(its.name);
      step.events.push_back(
          event_of(EventKind::joint_overload, step.robot, its.name, load, center, step.now));
    } else if (load < kRelieved && known != overloaded_.end()) {
      overloaded_.erase(known);
    }
  }
}

void RealGrip::update(const GripStep& step, bool frozen, Agents& agents) {
  const RobotTwin& twin = step.twin;
  if (frozen || twin.fingers().empty()) return;
  poses_ = poses_of(twin);
  const std::string& pressed = held_.empty() ? too_heavy_ : held_;
  const Agent* thing = agents.find(pressed.empty() ? around_ : pressed);
  if (thing != nullptr && !pressed.empty()) {
    const auto its = pinch(twin, poses_, *thing);
    if (thing->epoch != epoch_ || !its || its->gap > its->width + kLoose) {
      release(thing, step.physics);
    } else if (!held_.empty()) {
      watch_load(step, *thing);
    }
  } else if (thing != nullptr) {
    const auto its = pinch(twin, poses_, *thing);
    if (its && its->between && its->gap <= its->width + kTouch) take(step, *thing);
  }
  if (held_.empty() && too_heavy_.empty()) look(twin, agents);
}

std::vector<FingerForce> RealGrip::forces() const {
  const std::string& pressed = held_.empty() ? too_heavy_ : held_;
  if (pressed.empty()) return {};
  return {{&pressed, 0, force_}, {&pressed, 1, force_}};
}

}  // namespace parhelion::simulation
