#include "server/simulation/bodies/watches.hpp"

#include <algorithm>
#include <cmath>

#include "server/simulation/building/building.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kLevelStep = 0.02;   // m: a smaller difference is the same level
constexpr double kMinFall = 0.05;     // m
constexpr double kFloorReach = 0.30;  // m: a floor farther below or above base_link does not support it

/// z of the lowest point of the body's bounding box, map frame.
double lowest_point(const Supervised& body, const ObservedMotion& motion) {
  const Eigen::Vector3d up = motion.T_map_base.rotation().row(2);
  double z = motion.T_map_base.translation().z();
  for (int axis = 0; axis < 3; ++axis) z += std::min(up[axis] * body.low[axis], up[axis] * body.high[axis]);
  return z;
}

}  // namespace

Event event_of(EventKind kind, const Supervised& body, const ObservedMotion& motion, double value) {
  Event event;
  event.stamp = motion.stamp;
  event.kind = kind;
  event.subject = body.name;
  event.position = motion.T_map_base.translation();
  event.value = value;
  return event;
}

void MovementWatch::update(const Supervised& body, const ObservedMotion& motion, std::vector<Event>& events) {
  const double speed = motion.velocity.norm(), rate = motion.rotation_rate.norm();
  if (!moving_) {
    if (speed <= kStartSpeed && rate <= kStartRate) return;
    moving_ = true;
    slow_since_.reset();
    events.push_back(event_of(EventKind::movement_started, body, motion, speed));
    return;
  }
  if (speed >= kStopSpeed || rate >= kStopRate) return slow_since_.reset();
  if (!slow_since_) slow_since_ = motion.stamp;
  if ((motion.stamp - *slow_since_).seconds() >= kPause) close(body, motion, events);
}

void MovementWatch::close(const Supervised& body, const ObservedMotion& last, std::vector<Event>& events) {
  if (!moving_) return;
  moving_ = false;
  events.push_back(event_of(EventKind::movement_stopped, body, last));
}

bool AttitudeWatch::Latch::update(double size, double threshold) {
  if (size < kRearm * threshold) passed = false;
  if (passed || !(size > threshold)) return false;
  passed = true;
  return true;
}

void AttitudeWatch::update(const Supervised& body, const ObservedMotion& motion, std::vector<Event>& events) {
  if (motion.attitude_known) {
    watch_tilt(body, motion, events);
  } else {
    pitch_warning_ = pitch_limit_ = roll_warning_ = roll_limit_ = {};
    tipped_ = false;
  }
  if (body.limits) watch_yaw_rate(body, motion, events);
}

void AttitudeWatch::watch_tilt(const Supervised& body, const ObservedMotion& motion,
                               std::vector<Event>& events) {
  const Eigen::Matrix3d R = motion.T_map_base.rotation();
  const auto report = [&](EventKind kind, double value) {
    events.push_back(event_of(kind, body, motion, value));
  };
  const double level = std::hypot(R(2, 1), R(2, 2));
  if (body.limits && !tipped_) {
    const double pitch = std::atan2(-R(2, 0), level), roll = std::atan2(R(2, 1), R(2, 2));
    const AttitudeLimits& limits = *body.limits;
    if (pitch_warning_.update(std::abs(pitch), limits.pitch_warning)) report(EventKind::pitch_warning, pitch);
    if (pitch_limit_.update(std::abs(pitch), limits.pitch_limit)) report(EventKind::pitch_limit, pitch);
    if (roll_warning_.update(std::abs(roll), limits.roll_warning)) report(EventKind::roll_warning, roll);
    if (roll_limit_.update(std::abs(roll), limits.roll_limit)) report(EventKind::roll_limit, roll);
  }
  const double tilt = std::atan2(std::hypot(R(2, 0), R(2, 1)), R(2, 2));
  if (tilt < kUpright) tipped_ = false;
  if (tipped_ || !(tilt > kTipped)) return;
  tipped_ = true;
  report(EventKind::tipped_over, tilt);
}

void AttitudeWatch::watch_yaw_rate(const Supervised& body, const ObservedMotion& motion,
                                   std::vector<Event>& events) {
  const double rate = motion.T_map_base.isometry().linear().col(2).dot(motion.rotation_rate);
  if (yaw_warning_.update(std::abs(rate), body.limits->yaw_rate_warning))
    events.push_back(event_of(EventKind::yaw_rate_warning, body, motion, rate));
  if (yaw_limit_.update(std::abs(rate), body.limits->yaw_rate_limit))
    events.push_back(event_of(EventKind::yaw_rate_limit, body, motion, rate));
}

void FallWatch::update(const Supervised& body, const ObservedMotion& motion, double dt,
                       std::vector<Event>& events) {
  const double lowest = lowest_point(body, motion);
  const double middle = (motion.T_map_base * Eigen::Vector3d((body.low + body.high) / 2)).z();
  const double sinks = (lowest_ - lowest) / dt, middle_sinks = (middle_ - middle) / dt;
  const bool fresh = !known_ || epoch_ != motion.epoch;
  known_ = true;
  epoch_ = motion.epoch;
  lowest_ = lowest;
  middle_ = middle;
  if (fresh) {
    falling_ = reported_ = false;
    top_ = lowest;
    return;
  }
  if (!falling_ && sinks > kFall && middle_sinks > kFall) falling_ = true;
  const double depth = top_ - lowest;
  const bool landed = falling_ && sinks <= kSink;
  if (falling_ && !reported_ && (landed || depth > kAbyss) && depth > kMinFall) {
    events.push_back(event_of(EventKind::fell, body, motion, depth));
    reported_ = true;
  }
  if (sinks > kSink) return;
  falling_ = reported_ = false;
  top_ = lowest;
}

/// The highest step under base_link with its top at most kReach above it.
const FixedObstacle* StepWatch::step_under(const Building& building, const Eigen::Vector3d& p) {
  near_.clear();
  building.near(p.head<2>(), kEdge, p.z() - 1, p.z() + 1, near_);
  const FixedObstacle* best = nullptr;
  for (const FixedObstacle* step : near_) {
    if (step->label != EntityLabel::stairs || step->top > p.z() + kReach) continue;
    if (signed_distance(point_, step->footprint) > (step->name == current_ ? kEdge : 0)) continue;
    if (best == nullptr || step->top > best->top) best = step;
  }
  return best;
}

void StepWatch::update(const Supervised& body, const ObservedMotion& motion, const Building& building,
                       std::vector<Event>& events) {
  const Eigen::Vector3d p = motion.T_map_base.translation();
  if (!known_) point_ = make_disc({0, 0}, 0);
  point_.vertices[0] = point_.center = p.head<2>();
  const FixedObstacle* step = step_under(building, p);
  double level = p.z();
  if (step != nullptr) {
    level = step->top;
  } else if (const double floor = building.floor_height(point_); std::abs(floor - level) < kFloorReach) {
    level = floor;
  }
  const bool fresh = !known_ || epoch_ != motion.epoch;
  known_ = true;
  epoch_ = motion.epoch;
  const bool higher = step != nullptr && step->name != current_ && level > level_ + kLevelStep;
  if (!fresh && higher) {
    Event event = event_of(EventKind::step_climbed, body, motion, level - began_);
    event.object = step->name;
    event.text = step->relation;
    events.push_back(std::move(event));
  } else if (fresh || step == nullptr || level < level_ - kLevelStep) {
    began_ = level;  // on a floor, or going down: a later climb starts here
  }
  level_ = level;
  current_ = step != nullptr ? step->name : std::string();
}

void ZoneWatch::update(const Supervised& body, const ObservedMotion& motion, const std::vector<Zone>& zones,
                       std::vector<Event>& events) {
  in_.resize(zones.size());
  for (std::size_t i = 0; i < zones.size(); ++i) {
    const bool now = inside(zones[i], motion.T_map_base.translation(), in_[i] ? kEdge : 0);
    if (now == in_[i]) continue;
    in_[i] = now;
    events.push_back(event_of(now ? EventKind::zone_entered : EventKind::zone_left, body, motion));
    events.back().object = zones[i].name;
  }
}

void ZoneWatch::close(const Supervised& body, const ObservedMotion& last, const std::vector<Zone>& zones,
                      std::vector<Event>& events) {
  for (std::size_t i = 0; i < in_.size(); ++i) {
    if (!in_[i]) continue;
    in_[i] = false;
    events.push_back(event_of(EventKind::zone_left, body, last));
    events.back().object = zones[i].name;
  }
}

}  // namespace parhelion::simulation
