#include "server/simulation/bodies/prediction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "protocols/convex_hull.hpp"
#include "server/simulation/robots/robot_model.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kFar = 0.2;         // m between bounding circles: below this, the outlines are compared
constexpr double kSameTwist = 0.02;  // m/s and rad/s: smaller differences count as the same motion

bool still(const Twist2& twist) { return twist.vx == 0 && twist.vy == 0 && twist.wz == 0; }

Eigen::Isometry3d moved_by(const RobotJoint& joint, double position) {
  if (joint.kind == JointKind::fixed) return Eigen::Isometry3d::Identity();
  if (joint.kind == JointKind::prismatic)
    return Eigen::Isometry3d(Eigen::Translation3d(position * joint.axis));
  return Eigen::Isometry3d(Eigen::AngleAxisd(position, joint.axis));
}

/// T_base_link of every link.
std::vector<Eigen::Isometry3d> link_poses(const RobotModel& model, const Joints& joints) {
  std::vector<Eigen::Isometry3d> poses(model.links.size(), Eigen::Isometry3d::Identity());
  for (const RobotJoint& joint : model.joints) {
    double position = joint.start;
    for (std::size_t i = 0; i < joints.names.size() && i < joints.positions.size(); ++i) {
      if (joints.names[i] == joint.name) position = joints.positions[i];
    }
    poses[joint.child] = poses[joint.parent] * joint.T_parent_child.isometry() * moved_by(joint, position);
  }
  return poses;
}

/// Points of a shape that may be its lowest, in any orientation.
void append_low_points(const Shape& shape, const Eigen::Isometry3d& T, std::vector<Eigen::Vector3d>& points) {
  if (shape.kind == ShapeKind::mesh) {
    for (const Eigen::Vector3d& corner : hull_corners(shape.mesh->vertices)) points.emplace_back(T * corner);
    return;
  }
  if (shape.kind == ShapeKind::box) {
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d p(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
      points.emplace_back(T * p.cwiseProduct(shape.size));
    }
    return;
  }
  const double radius = shape.size.x();
  if (shape.kind == ShapeKind::sphere) {
    points.emplace_back(T.translation() - radius * Eigen::Vector3d::UnitZ());
    return;
  }
  // Down to the rim of each end of a cylinder; straight down from the ends of a capsule.
  Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis = T.linear().col(2);
  if (shape.kind == ShapeKind::cylinder) down -= down.dot(axis) * axis;
  if (down.norm() < 1e-6) down = T.linear().col(0);
  for (const double end : {-0.5, 0.5})
    points.emplace_back(T * Eigen::Vector3d(0, 0, end * shape.size.z()) + radius * down.normalized());
}

}  // namespace

double time_to_contact(const MovingFootprint& a, const MovingFootprint& b, double touch, double horizon) {
  const double closing = fastest_point_speed(*a.local, a.twist) + fastest_point_speed(*b.local, b.twist);
  thread_local Footprint placed_a, placed_b;  // reused memory
  place(*a.local, a.pose, placed_a);
  place(*b.local, b.pose, placed_b);
  if (!(closing > 0) || distance_bound(placed_a, placed_b) - touch > closing * horizon) return kInfinity;
  for (double t = 0; t <= horizon;) {
    const double bound = distance_bound(placed_a, placed_b) - touch;
    double gap = bound > kFar ? bound : separation(placed_a, placed_b) - touch;
    if (gap <= 0) gap = signed_distance(placed_a, placed_b) - touch;
    if (gap <= 0) return t > 0 ? t : kInfinity;
    t += std::max(gap / closing, kMinAdvance);
    if (!still(a.twist)) place(*a.local, advance(a.pose, a.twist, t), placed_a);
    if (!still(b.twist)) place(*b.local, advance(b.pose, b.twist, t), placed_b);
  }
  return kInfinity;
}

bool CollisionPrediction::due(SimulationTime now, const Twist2& twist) const {
  if (!checked_at_) return true;
  const double since = (now - *checked_at_).seconds();
  const double change = std::max(
      {std::abs(twist.vx - twist_.vx), std::abs(twist.vy - twist_.vy), std::abs(twist.wz - twist_.wz)});
  return since >= wait_ || (!is_warned_ && (change > kSameTwist || time_ - since <= kWarn));
}

void CollisionPrediction::update(const Supervised& body, const ObservedMotion& motion, const Twist2& twist,
                                 const std::optional<Ahead>& ahead, std::vector<Event>& events) {
  if (checked_at_) wait_ = kPeriod;
  checked_at_ = motion.stamp;
  twist_ = twist;
  time_ = ahead ? ahead->time : kRearm;
  if (ahead) {
    const auto known = warned_.find(ahead->object);
    if (known != warned_.end()) {
      known->second = motion.stamp;
    } else if (ahead->time <= kWarn) {
      warned_.emplace(ahead->object, motion.stamp);
      Event event = event_of(EventKind::collision_predicted, body, motion, ahead->time);
      event.object = ahead->object;
      event.text = ahead->relation;
      event.pair = ahead->pair;
      event.undetectable = ahead->undetectable;
      event.position = ahead->position;
      events.push_back(std::move(event));
    }
  }
  is_warned_ = ahead && warned_.contains(ahead->object);
  std::erase_if(warned_, [&](const auto& each) { return (motion.stamp - each.second).seconds() > kHold; });
}

void TippingPrediction::update(const Supervised& body, const ObservedMotion& motion, const Tipping& tipping,
                               std::vector<Event>& events) {
  const bool threatened = tipping.fraction < kSmallMargin && tipping.time <= kWarn;
  if (threatened) threatened_ = motion.stamp;
  if (threatened && !warned_)
    events.push_back(event_of(EventKind::tipping_predicted, body, motion, tipping.time));
  warned_ = threatened || (warned_ && (motion.stamp - threatened_).seconds() <= kHold);
}

Tipping AttitudeTrend::update(const Transform<Map, Base>& T_map_base, const AttitudeLimits& limits,
                              double dt) {
  const Eigen::Matrix3d R = T_map_base.rotation();
  const double pitch = std::abs(std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))));
  const double roll = std::abs(std::atan2(R(2, 1), R(2, 2)));
  const double fraction = 1 - std::max(pitch / limits.pitch_limit, roll / limits.roll_limit);
  const double trend = known_ ? (fraction - fraction_) / dt : 0;
  trend_ += (trend - trend_) * std::min(1.0, dt / kSmoothing);
  known_ = true;
  fraction_ = fraction;
  if (fraction <= 0) return {fraction, 0};
  return {fraction, trend_ < 0 ? fraction / -trend_ : kInfinity};
}

Stance stance_of(const RobotModel& model, const Joints& joints) {
  const auto poses = link_poses(model, joints);
  Stance stance;
  double mass = 0, lowest = kInfinity;
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    const RobotLink& link = model.links[i];
    mass += link.mass;
    stance.center_of_mass += link.mass * (poses[i] * link.center);
    for (const Shape& shape : link.solid)
      append_low_points(shape, poses[i] * shape.T_body_shape.isometry(), points);
  }
  if (mass > 0) stance.center_of_mass /= mass;
  for (const Eigen::Vector3d& p : points) lowest = std::min(lowest, p.z());
  for (const Eigen::Vector3d& p : points) {
    if (p.z() <= lowest + kFootHeight) stance.support.push_back(p.head<2>());
  }
  stance.support = convex_hull(std::move(stance.support));
  stance.center_of_mass.z() -= std::isfinite(lowest) ? lowest : 0;
  return stance;
}

Tipping tipping_of(const Stance& stance, const Eigen::Vector3d& up, const Eigen::Vector3d& rotation_rate) {
  Tipping nearest{1, kInfinity};
  const auto& support = stance.support;
  for (std::size_t i = 0; support.size() >= 3 && i < support.size(); ++i) {
    const Eigen::Vector2d &from = support[i], &to = support[(i + 1) % support.size()];
    const Eigen::Vector3d edge = Eigen::Vector3d(to.x() - from.x(), to.y() - from.y(), 0).normalized();
    const Eigen::Vector3d arm = stance.center_of_mass - Eigen::Vector3d(from.x(), from.y(), 0);
    const auto angle_inside = [&](const Eigen::Vector3d& upwards) {
      const Eigen::Vector3d across = upwards - upwards.dot(edge) * edge;
      // Gravity gives no moment about a vertical edge.
      if (across.norm() < 0.1) return kInfinity;
      return std::atan2(arm.dot(across.normalized().cross(edge)), arm.dot(across.normalized()));
    };
    const double level = angle_inside(Eigen::Vector3d::UnitZ()), left = angle_inside(up);
    if (!(level > 0) || !std::isfinite(left)) continue;
    const double rate = rotation_rate.dot(edge);
    nearest.fraction = std::min(nearest.fraction, left / level);
    if (left <= 0) nearest.time = 0;
    // It does not tip over an edge with a large margin.
    if (rate > 0 && left / level < TippingPrediction::kSmallMargin)
      nearest.time = std::min(nearest.time, std::max(0.0, left) / rate);
  }
  return nearest;
}

}  // namespace parhelion::simulation
