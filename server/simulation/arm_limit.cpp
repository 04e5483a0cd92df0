#include "server/simulation/arm_limit.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "server/simulation/arm_travel.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kAll = 0.98;        // of the horizon: what is left out by rounding
constexpr double kMinTravel = 1e-5;  // rad or m: a shorter travel is none

enum class Mode { position, velocity, effort };

/// One joint of a command, as a motion.
struct Asked {
  std::size_t place = 0;  // in the command
  JointMotion motion;
};

class Limiter {
 public:
  Limiter(const RealRobot& robot, const Agents& agents, const Physics& physics, double horizon, Mode mode,
          Joints& command)
      : robot_(robot), agents_(agents), physics_(physics), horizon_(horizon), mode_(mode), command_(command) {
    for (std::size_t i = 0; i < command.names.size(); ++i) {
      if (auto motion = motion_of(i)) asked_.push_back({i, *motion});
    }
  }

  /// As a whole where that is free; else joint by joint; then what is left in one proportion.
  std::vector<Simulation::LimitedJoint> limit() {
    if (travel_of(motions()).time >= kAll * horizon_) return {};
    for (Asked& each : asked_) {
      const ArmTravel alone = travel_of({each.motion});
      if (alone.time < kAll * horizon_) reduce(each, alone);
    }
    const ArmTravel together = travel_of(motions());
    if (together.time < kAll * ends_) {
      for (Asked& each : asked_)
        if (each.motion.velocity != 0) reduce(each, together);
    }
    return std::move(limited_);
  }

 private:
  std::optional<JointMotion> motion_of(std::size_t i) const {
    const auto& joints = robot_.twin->model().joints;
    const auto joint = std::find_if(joints.begin(), joints.end(),
                                    [&](const RobotJoint& each) { return each.name == command_.names[i]; });
    if (joint == joints.end()) return std::nullopt;
    JointMotion motion;
    motion.joint = static_cast<std::size_t>(joint - joints.begin());
    if (mode_ == Mode::velocity) motion.velocity = command_.velocities[i];
    if (mode_ == Mode::effort && command_.efforts[i] != 0)
      motion.velocity = std::copysign(joint->velocity, command_.efforts[i]);
    if (mode_ != Mode::position) return motion;
    motion.target = command_.positions[i];
    const double travel_needed = *motion.target - robot_.twin->posture().positions[motion.joint];
    double speed = joint->velocity;
    if (!command_.velocities.empty() && command_.velocities[i] != 0)
      speed = std::min(speed, std::abs(command_.velocities[i]));
    motion.velocity = travel_needed == 0 ? 0 : std::copysign(speed, travel_needed);
    return motion;
  }

  std::vector<JointMotion> motions() const {
    std::vector<JointMotion> all;
    for (const Asked& each : asked_) all.push_back(each.motion);
    return all;
  }

  ArmTravel travel_of(const std::vector<JointMotion>& motions) const {
    return joint_travel(robot_, agents_, physics_, motions, horizon_);
  }

  void reduce(Asked& each, const ArmTravel& travel) {
    const double from = robot_.twin->posture().positions[each.motion.joint];
    JointMotion& motion = each.motion;
    if (mode_ == Mode::position) {
      const double reached = from + motion.velocity * travel.time;
      motion.target =
          motion.velocity < 0 ? std::max(reached, *motion.target) : std::min(reached, *motion.target);
      command_.positions[each.place] = *motion.target;
      if (std::abs(*motion.target - from) < kMinTravel) motion.velocity = 0;
      if (motion.velocity != 0) ends_ = std::min(ends_, travel.time);
    } else {
      motion.velocity *= mode_ == Mode::velocity ? travel.time / horizon_ : 0;
      (mode_ == Mode::velocity ? command_.velocities : command_.efforts)[each.place] =
          mode_ == Mode::velocity ? motion.velocity : 0;
    }
    const std::string& name = command_.names[each.place];
    const bool known = std::any_of(limited_.begin(), limited_.end(),
                                   [&](const Simulation::LimitedJoint& one) { return one.joint == name; });
    if (!known) limited_.push_back({name, travel.thing});
  }

  const RealRobot& robot_;
  const Agents& agents_;
  const Physics& physics_;
  const double horizon_;
  const Mode mode_;
  Joints& command_;
  double ends_ = horizon_;  // s: a reduced motion reaches its target, beside the thing
  std::vector<Asked> asked_;
  std::vector<Simulation::LimitedJoint> limited_;
};

}  // namespace

std::vector<Simulation::LimitedJoint> limit_joints(const RealRobot& robot, const Agents& agents,
                                                   const Physics& physics, double reaction, double holds,
                                                   Joints& command) {
  const Mode mode = !command.positions.empty()    ? Mode::position
                    : !command.velocities.empty() ? Mode::velocity
                                                  : Mode::effort;
  if (mode == Mode::effort && command.efforts.empty()) return {};
  const double horizon = mode == Mode::position ? holds : reaction;
  return Limiter(robot, agents, physics, horizon, mode, command).limit();
}

}  // namespace parhelion::simulation
