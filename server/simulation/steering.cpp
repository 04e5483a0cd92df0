#include "server/simulation/steering.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace parhelion {
namespace {

constexpr double kTouch = 0.002;     // m: as near as advancement goes to an obstacle's margin
constexpr int kMostAdvances = 40;    // then the way so far is the answer: too short, never too long
constexpr double kFirstStep = 0.02;  // m
constexpr double kLookahead = 2.0;   // m
constexpr std::array<double, 9> kCurvatures{0, 0.4, -0.4, 1.0, -1.0, 2.0, -2.0, 4.0, -4.0};  // 1/m

}  // namespace

double free_length(const Pose2& pose, double radius, double margin, double kappa, double limit,
                   const std::vector<const Footprint*>& obstacles) {
  Footprint disc = make_disc(pose.position(), radius);
  const Twist2 arc{1, 0, kappa};
  double way = limit;
  for (const Footprint* obstacle : obstacles) {
    disc.center = disc.vertices[0] = pose.position();
    if (distance_bound(disc, *obstacle) > way + margin) continue;
    const double at_start = signed_distance(disc, *obstacle);
    const double keep = std::min(margin, at_start);
    const double first = at_start < margin ? kFirstStep : 0;  // shows whether the arc leads away
    double s = first;
    for (int n = 0; s < way && n < kMostAdvances; ++n) {
      disc.center = disc.vertices[0] = advance(pose, arc, s).position();
      const double gap = signed_distance(disc, *obstacle) - keep;
      if (gap < kTouch) break;
      s += gap;
    }
    if (first > 0 && s <= first) s = 0;
    way = std::min(way, s);
  }
  return way;
}

Twist2 steer(const Pose2& pose, const SteeringLimits& limits, const std::vector<const Footprint*>& obstacles,
             SteeringState& state) {
  const double needed = limits.speed * limits.speed / (2 * limits.acceleration) + 0.15 * limits.speed;
  const double to_heading = wrap_angle(state.heading - pose.yaw);
  double best_score = 0, best_kappa = 0, best_way = 0;
  bool any = false;
  for (const double kappa : kCurvatures) {
    const double way = free_length(pose, limits.radius, limits.margin, kappa, kLookahead, obstacles);
    if (way < 0.3) continue;
    // Heading at the end of a metre of it; the nearer to the wanted one the better, and the freer.
    const double miss = std::abs(wrap_angle(to_heading - std::clamp(kappa, -2.5, 2.5) * std::min(way, 1.0)));
    const double score = 1.0 - miss / 3.2 + 0.6 * way / kLookahead - 0.02 * std::abs(kappa);
    if (!any || score > best_score) {
      any = true;
      best_score = score;
      best_kappa = kappa;
      best_way = way;
    }
  }
  const bool behind = std::abs(to_heading) > 1.9;
  if (!any || (behind && state.turn != 0)) {
    if (state.turn == 0) state.turn = to_heading >= 0 ? 1 : -1;
    return {0, 0, state.turn * limits.yaw_rate};
  }
  state.turn = 0;
  double v = limits.speed * std::min(1.0, best_way / std::max(needed, 0.3));
  v = std::min(v, std::sqrt(2 * limits.acceleration * best_way));
  if (std::abs(best_kappa) > 0) v = std::min(v, limits.yaw_rate / std::abs(best_kappa));
  // Fine heading: on a free straight way the wanted heading is met exactly.
  double w = best_kappa * v;
  if (best_kappa == 0 && std::abs(to_heading) < 0.4 && best_way >= kLookahead) {
    const double kappa = std::clamp(to_heading, -0.4, 0.4);
    if (free_length(pose, limits.radius, limits.margin, kappa, kLookahead, obstacles) >= best_way)
      w = kappa * v;
  }
  return {v, 0, w};
}

}  // namespace parhelion
