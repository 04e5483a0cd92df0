#include "server/simulation/virtual_contact.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::simulation {
namespace {

bool is_zero(const Twist2& twist) { return twist.vx == 0 && twist.vy == 0 && twist.wz == 0; }

/// Never larger than `value`, same sign; plain zero instead of minus zero.
double scaled(double value, double scale) { return scale >= 1 ? value : scale * value + 0.0; }

VirtualContactResult result(const VirtualContactInput& input, double scale, SpeedLimitReason reason) {
  VirtualContactResult answer;
  answer.scale = scale;
  answer.reason = reason;
  if (!input.teleop) return answer;
  answer.command.stamp = input.teleop->stamp;
  if (scale <= 0) return answer;  // not 0 * x: x may be infinite
  const Twist2& asked = input.teleop->twist;
  answer.command.twist = {scaled(asked.vx, scale), scaled(asked.vy, scale), scaled(asked.wz, scale)};
  return answer;
}

/// The cause that holds the robot until the dead-man is released.
SpeedLimitReason held_by(const VirtualContactInput& input, bool released, const VirtualContactState& state) {
  if (input.emergency_stop) return SpeedLimitReason::emergency_stop;
  if (input.stop) return *input.stop;
  if (released) return SpeedLimitReason::none;
  if (input.localization_lost && !state.released_since_loss) return SpeedLimitReason::localization_lost;
  return state.held;
}

/// The reason that is reported: the cause itself, or that it is over and only the release is missing.
SpeedLimitReason shown(const VirtualContactInput& input, SpeedLimitReason held) {
  const bool lasts =
      input.stop.has_value() || (held == SpeedLimitReason::localization_lost && !input.pose_known);
  return lasts || held == SpeedLimitReason::emergency_stop ? held : SpeedLimitReason::not_released;
}

double stopping_distance(const RobotLimits& robot, double speed) {
  return speed * robot.reaction_time + speed * speed / (2 * robot.deceleration);
}

}  // namespace

const char* to_string(SpeedLimitReason reason) {
  switch (reason) {
    case SpeedLimitReason::none:
      return "none";
    case SpeedLimitReason::contact:
      return "contact";
    case SpeedLimitReason::localization_lost:
      return "localization_lost";
    case SpeedLimitReason::crawl:
      return "crawl";
    case SpeedLimitReason::silence:
      return "silence";
    case SpeedLimitReason::invalid:
      return "invalid";
    case SpeedLimitReason::emergency_stop:
      return "emergency_stop";
    case SpeedLimitReason::robot_limits:
      return "robot_limits";
    case SpeedLimitReason::scans_silent:
      return "scans_silent";
    case SpeedLimitReason::two_drivers:
      return "two_drivers";
    case SpeedLimitReason::not_released:
      return "dead_man_not_released";
  }
  return "unknown";
}

double footprint_speed(const RobotDescription& robot, const Twist2& twist) {
  double fastest = std::hypot(twist.vx, twist.vy);
  for (const Eigen::Vector2d& v : robot.footprint) {
    fastest = std::max(fastest, std::hypot(twist.vx - twist.wz * v.y(), twist.vy + twist.wz * v.x()));
  }
  return fastest;
}

double limits_scale(const RobotLimits& robot, const Twist2& twist) {
  // A little less, so that rounding never gives more than the limit.
  constexpr double kBelow = 1 - 1e-14;
  const double speed = std::hypot(twist.vx, twist.vy), yaw_rate = std::abs(twist.wz);
  double scale = 1;
  if (speed > robot.speed) scale = kBelow * robot.speed / speed;
  if (yaw_rate > robot.yaw_rate) scale = std::min(scale, kBelow * robot.yaw_rate / yaw_rate);
  return scale;
}

double contact_lookahead(const ContactLimits& limits, const RobotDescription& robot, const Twist2& twist) {
  const double speed = limits_scale(robot.limits, twist) * footprint_speed(robot, twist);
  const double braking = limits.stop_distance + stopping_distance(robot.limits, speed);
  // With a margin, so that rounding does not reduce a free command.
  return 1.001 * std::max(limits.slow_distance, braking) + 1e-6;
}

double contact_scale(const ContactLimits& limits, const RobotLimits& robot, double distance, double speed) {
  const double room = distance - limits.stop_distance;
  if (!(room > 0)) return 0;
  const double ramp = limits.slow_distance - limits.stop_distance;
  const double slowed = ramp > 0 ? std::min(1.0, room / ramp) : 1.0;
  if (!(speed > 0)) return slowed;
  // The largest v with v r + v^2 / (2 a) = room, in a form without cancellation.
  const double a = robot.deceleration, r = robot.reaction_time;
  const double brakeable = 2 * room / (r + std::sqrt(r * r + 2 * room / a));
  return std::clamp(std::min(slowed, brakeable / speed), 0.0, 1.0);
}

VirtualContactResult limit(const ContactLimits& limits, const RobotDescription& robot,
                           const VirtualContactInput& input, VirtualContactState& state) {
  const bool silent = !input.teleop || input.teleop_age.seconds() >= limits.silence;
  const bool released = silent || (is_zero(input.teleop->twist) && !input.own_stop);
  state.released_since_loss = !input.pose_known && (state.released_since_loss || released);
  state.held = held_by(input, released, state);
  if (silent) return result(input, 0, SpeedLimitReason::silence);
  if (state.held != SpeedLimitReason::none) return result(input, 0, shown(input, state.held));

  const Twist2& asked = input.teleop->twist;
  const double asked_speed = footprint_speed(robot, asked);
  if (!std::isfinite(asked_speed) || !std::isfinite(asked.wz))
    return result(input, 0, SpeedLimitReason::invalid);
  const double allowed = limits_scale(robot.limits, asked);
  if (!input.pose_known) {
    if (!state.released_since_loss) return result(input, 0, SpeedLimitReason::localization_lost);
    const double crawl = asked_speed > limits.crawl_speed ? limits.crawl_speed / asked_speed : 1.0;
    return result(input, std::min(allowed, crawl), SpeedLimitReason::crawl);
  }
  if (released) return result(input, 1, SpeedLimitReason::none);
  const double contact = contact_scale(limits, robot.limits, input.clearance.distance, allowed * asked_speed);
  if (contact < 1) return result(input, allowed * contact, SpeedLimitReason::contact);
  return result(input, allowed, allowed < 1 ? SpeedLimitReason::robot_limits : SpeedLimitReason::none);
}

}  // namespace parhelion::simulation
