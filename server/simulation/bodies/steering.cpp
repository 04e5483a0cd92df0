#include "server/simulation/bodies/steering.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace parhelion::simulation {
namespace {

constexpr double kTouch = 0.002;  // m: tolerance of the advancement
constexpr int kMaxAdvances =
    40;  // then the distance so far is the result: possibly too short, never too long
constexpr double kLookahead = 2.0;    // m
constexpr double kMinDistance = 0.3;  // m: shorter arcs are not started
constexpr double kLeaving =
    0.25;  // m of distance gained per metre of arc away from an obstacle that is too close
constexpr double kCarefulSpeed = 0.25;  // m/s if only the narrow margin is free
constexpr std::array<double, 9> kCurvatures{0, 0.4, -0.4, 1.0, -1.0, 2.0, -2.0, 4.0, -4.0};  // 1/m

struct Arc {
  double kappa = 0;   // 1/m
  double length = 0;  // m
};

/// The best free arc towards the heading; way 0 if none is free.
Arc best_arc(const Pose2& pose, double radius, double margin, double to_heading, SteeringScratch& scratch) {
  Arc best;
  double best_score = 0;
  for (const double kappa : kCurvatures) {
    const double length = free_length(pose, radius, margin, kappa, kLookahead, scratch);
    if (length < kMinDistance) continue;
    // Heading after a metre of it; better if nearer to the desired one, and longer.
    const double miss =
        std::abs(wrap_angle(to_heading - std::clamp(kappa, -2.5, 2.5) * std::min(length, 1.0)));
    const double score = 1.0 - miss / 3.2 + 0.6 * length / kLookahead - 0.02 * std::abs(kappa);
    if (best.length > 0 && score <= best_score) continue;
    best = {kappa, length};
    best_score = score;
  }
  return best;
}

/// An obstacle is closer than the narrow margin.
bool crowded(const Pose2& pose, const SteeringLimits& limits, SteeringScratch& scratch) {
  Footprint& disc = scratch.disc;
  disc.vertices.resize(1);
  disc.radius = disc.bound = limits.radius;
  disc.center = disc.vertices[0] = pose.position();
  return std::any_of(scratch.obstacles.begin(), scratch.obstacles.end(), [&](const Footprint* obstacle) {
    return distance_bound(disc, *obstacle) < limits.narrow_margin &&
           signed_distance(disc, *obstacle) < limits.narrow_margin;
  });
}

}  // namespace

double free_length(const Pose2& pose, double radius, double margin, double kappa, double limit,
                   SteeringScratch& scratch) {
  Footprint& disc = scratch.disc;
  disc.vertices.resize(1);
  disc.radius = disc.bound = radius;
  const Twist2 arc{1, 0, kappa};
  double length = limit;
  for (const Footprint* obstacle : scratch.obstacles) {
    disc.center = disc.vertices[0] = pose.position();
    if (distance_bound(disc, *obstacle) > length + margin) continue;
    const double at_start = signed_distance(disc, *obstacle);
    double s = 0;
    for (int n = 0; s < length && n < kMaxAdvances; ++n) {
      const double keep = std::min(margin, at_start + kLeaving * s);
      if (s > 0) disc.center = disc.vertices[0] = advance(pose, arc, s).position();
      const double gap = (s > 0 ? signed_distance(disc, *obstacle) : at_start) - keep;
      // At the start of an escape from an obstacle the gap is zero: the next centimetre decides.
      if (s == 0 && at_start < margin + kTouch)
        s = 5 * kTouch;
      else if (gap < kTouch)
        break;
      else
        s += gap / (1 + kLeaving);
    }
    length = std::min(length, s <= 5 * kTouch ? 0 : s);
  }
  return length;
}

namespace {

/// Distance of the nearest obstacle after `length` m in the direction (cos, sin); none if that leads closer
/// to one that is too close.
std::optional<double> room_after(const Pose2& pose, const SteeringLimits& limits,
                                 const Eigen::Vector2d& direction, double length, SteeringScratch& scratch) {
  Footprint& disc = scratch.disc;
  double room = length;
  for (const Footprint* obstacle : scratch.obstacles) {
    disc.center = disc.vertices[0] = pose.position();
    if (distance_bound(disc, *obstacle) > 2 * length + limits.narrow_margin) continue;
    const double before = signed_distance(disc, *obstacle);
    disc.center = disc.vertices[0] = pose.position() + length * direction;
    const double after = signed_distance(disc, *obstacle);
    if (after < std::min(limits.narrow_margin, before)) return std::nullopt;
    room = std::min(room, after);
  }
  return room;
}

/// Escapes when no arc is free: the direction with the largest distance after a short motion, forwards or
/// backwards, whichever is nearer. Stops if there is none.
Twist2 escape(const Pose2& pose, const SteeringLimits& limits, SteeringScratch& scratch) {
  constexpr int directions = 24;
  constexpr double length = 0.15, aligned = 0.35;  // m, rad
  std::optional<double> best_room;
  double best_angle = 0;
  for (int i = 0; i < directions; ++i) {
    const double angle = 2 * std::numbers::pi * i / directions;
    const auto room = room_after(pose, limits, {std::cos(angle), std::sin(angle)}, length, scratch);
    if (!room || (best_room && *room <= *best_room)) continue;
    best_room = room;
    best_angle = angle;
  }
  if (!best_room) return {};
  const double ahead = wrap_angle(best_angle - pose.yaw);
  const bool backwards = std::abs(ahead) > std::numbers::pi / 2;
  const double turn = backwards ? wrap_angle(ahead + std::numbers::pi) : ahead;
  const double speed = std::min(limits.speed, kCarefulSpeed) * (backwards ? -1 : 1);
  return {std::abs(turn) < aligned ? speed : 0, 0, std::clamp(3 * turn, -limits.yaw_rate, limits.yaw_rate)};
}

}  // namespace

Twist2 steer(const Pose2& pose, const SteeringLimits& limits, SteeringScratch& scratch,
             SteeringState& state) {
  const double to_heading = wrap_angle(state.heading - pose.yaw);
  const bool pressed = crowded(pose, limits, scratch);
  double speed = limits.speed;
  Arc arc = best_arc(pose, limits.radius, limits.margin, to_heading, scratch);
  if (arc.length <= 0) {
    arc = best_arc(pose, limits.radius, limits.narrow_margin, to_heading, scratch);
    speed = std::min(speed, kCarefulSpeed);
  }
  if (arc.length <= 0 && pressed) {
    state.turn = 0;
    return escape(pose, limits, scratch);
  }
  // A crowded agent leaves by the first free arc, before turning to its heading.
  const bool behind = std::abs(to_heading) > 1.9 && !pressed;
  if (arc.length <= 0 || (behind && state.turn != 0)) {
    if (state.turn == 0) state.turn = to_heading >= 0 ? 1 : -1;
    return {0, 0, state.turn * limits.yaw_rate};
  }
  state.turn = 0;
  double v = std::min(speed, std::sqrt(limits.acceleration * arc.length));
  if (arc.kappa != 0) v = std::min(v, limits.yaw_rate / std::abs(arc.kappa));
  double w = arc.kappa * v;
  // On a free straight line the desired heading is reached exactly.
  if (arc.kappa == 0 && std::abs(to_heading) < 0.4 && arc.length >= kLookahead) {
    const double kappa = std::clamp(to_heading, -0.4, 0.4);
    if (free_length(pose, limits.radius, limits.margin, kappa, kLookahead, scratch) >= arc.length)
      w = kappa * v;
  }
  return {v, 0, w};
}

}  // namespace parhelion::simulation
