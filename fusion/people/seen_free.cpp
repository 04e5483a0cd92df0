#include "fusion/people/seen_free.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

namespace parhelion::people {
namespace {

/// The same as std::remainder, which is slow: here most angles are within three half turns.
double within_half_turn(double angle) {
  constexpr double turn = 2 * std::numbers::pi;
  if (!(std::abs(angle) < 1.5 * turn)) return std::remainder(angle, turn);
  return std::abs(angle) <= std::numbers::pi ? angle : angle - std::copysign(turn, angle);
}

}  // namespace

PlaceEvidence SeenFree::at(const Eigen::Vector2d& place, double radius, double sigma,
                           SimulationTime now) const {
  PlaceEvidence evidence;
  Duration newest_free{std::numeric_limits<std::int64_t>::max()};
  for (const std::vector<PastScan>* ring : {&recent_, &old_}) {
    for (const PastScan& past : *ring) {
      const Duration age = now - past.stamp;
      if (!past.valid || age < options_.min_age) continue;
      count(look(past, place, radius, sigma), ring == &old_, age, evidence, newest_free);
    }
  }
  evidence.occupied_for = std::min(evidence.occupied_for, newest_free);
  return evidence;
}

void SeenFree::count(Look what, bool old, Duration age, PlaceEvidence& evidence, Duration& newest_free) {
  if (what == Look::occupied) {
    ++evidence.occupied;
    evidence.old_occupied += old ? 1 : 0;
    evidence.occupied_for = std::max(evidence.occupied_for, age);
  } else if (what == Look::free) {
    ++evidence.free;
    newest_free = std::min(newest_free, age);
  }
}

SeenFree::Look SeenFree::look(const PastScan& past, const Eigen::Vector2d& place, double radius,
                              double sigma) const {
  const Pose2& T = past.T_laser_map;
  const Eigen::Vector2d p(T.x + past.cos_yaw * place.x() - past.sin_yaw * place.y(),
                          T.y + past.sin_yaw * place.x() + past.cos_yaw * place.y());
  const double distance = p.norm();
  const double half_width = radius + options_.margin + sigma;
  if (!(distance > half_width)) return Look::unknown;
  const double step = past.angle_increment;
  const double bearing = within_half_turn(std::atan2(p.y(), p.x()) - past.angle_min -
                                          step * static_cast<double>(past.free_to.size()) / 2);
  const double middle = bearing / step + static_cast<double>(past.free_to.size()) / 2;
  const double reach = std::asin(half_width / distance) / std::abs(step) + 0.5;
  const double first = std::ceil(middle - reach), last = std::floor(middle + reach);
  if (!(first >= 0) || !(last < static_cast<double>(past.free_to.size())) || last < first)
    return Look::unknown;
  float nearest = std::numeric_limits<float>::infinity();
  int known = 0, unknown = 0;
  const double depth = radius + options_.depth + sigma;
  const auto from = static_cast<std::size_t>(first), to = static_cast<std::size_t>(last) + 1;
  for (const float free_to : std::span(past.free_to).subspan(from, to - from)) {
    if (free_to < 0) {
      ++unknown;
      continue;
    }
    if (std::abs(double{free_to} - distance) < depth) return Look::occupied;
    ++known;
    nearest = std::min(nearest, free_to);
  }
  const bool through = known >= unknown && nearest > distance + options_.behind + sigma;
  return through ? Look::free : Look::unknown;
}

void SeenFree::add(const LaserSweep& sweep) {
  if (recent_.empty()) {
    recent_.resize(options_.recent);
    old_.resize(options_.old);
    // All at once, so that no later scan allocates.
    for (std::vector<PastScan>* ring : {&recent_, &old_})
      for (PastScan& past : *ring) past.free_to.reserve(sweep.scan.ranges.size());
  }
  const auto due = [&](const std::vector<PastScan>& ring, std::size_t next, Duration period) {
    const PastScan& newest = ring[(next + ring.size() - 1) % ring.size()];
    return !newest.valid || sweep.stamp - newest.stamp >= period - milliseconds(1);
  };
  if (due(recent_, next_recent_, options_.recent_period)) {
    store(sweep, recent_[next_recent_]);
    next_recent_ = (next_recent_ + 1) % recent_.size();
  }
  if (due(old_, next_old_, options_.old_period)) {
    store(sweep, old_[next_old_]);
    next_old_ = (next_old_ + 1) % old_.size();
  }
}

void SeenFree::store(const LaserSweep& sweep, PastScan& slot) const {
  slot.valid = sweep.scan.angle_increment != 0 && std::isfinite(sweep.scan.angle_increment);
  slot.stamp = sweep.stamp;
  slot.T_laser_map =
      interpolate(planar(sweep.motion.T_map_laser_start), planar(sweep.motion.T_map_laser_end), 0.5)
          .inverse();
  slot.cos_yaw = std::cos(slot.T_laser_map.yaw);
  slot.sin_yaw = std::sin(slot.T_laser_map.yaw);
  slot.angle_min = sweep.scan.angle_min;
  slot.angle_increment = sweep.scan.angle_increment;
  const RangeConvention& convention = sweep.description.convention;
  slot.free_to.assign(sweep.scan.ranges.size(), -1);
  for (std::size_t i = 0; i < slot.free_to.size(); ++i) {
    const BeamKind kind = convention.classify(sweep.scan.ranges[i]);
    if (kind == BeamKind::hit) slot.free_to[i] = sweep.scan.ranges[i];
    if (kind == BeamKind::no_return) slot.free_to[i] = convention.range_max;
  }
}

}  // namespace parhelion::people
