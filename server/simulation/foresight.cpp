// What is ahead of the real robot and of simulated ones at each step.
#include <algorithm>
#include <cmath>

#include "server/simulation/state.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kTouch = 0.001;        // m: nearer is contact
constexpr double kMostMargin = 0.10;    // m, as of contacts
constexpr double kUnderfoot = 0.02;     // m over base_link: lower is driven over
constexpr double kMostClimb = 0.30;     // m: over their own plane steps are climbed by tracks
constexpr double kFlight = 0.8;         // slope of the steepest stairs
constexpr double kClosingSpeed = 0.02;  // m/s: slower, it stands
constexpr std::uint64_t kTurns = 4;     // in which robots look ahead
constexpr double kSameJoints = 0.005;   // rad and m: less is the same stance

Twist2 twist_of(const RigidState& rigid) {
  const Eigen::Vector3d v = rigid.T_map_body.rotation().transpose() * rigid.velocity;
  return {v.x(), v.y(), rigid.rotation_rate.z()};
}

/// No point of it is faster, m/s.
double most_speed(const MovingFootprint& it) {
  const double reach = it.local->center.norm() + it.local->bound;
  return std::sqrt(it.twist.vx * it.twist.vx + it.twist.vy * it.twist.vy) + std::abs(it.twist.wz) * reach;
}

PairKind pair_of(bool a_virtual, bool b_virtual) {
  if (a_virtual != b_virtual) return PairKind::real_virtual;
  return a_virtual ? PairKind::virtual_virtual : PairKind::real_real;
}

}  // namespace

/// What is so near that it may become a near miss.
void Simulation::State::look_beside(const Looking& from, const Footprint& placed, const std::string& name,
                                    PairKind pair, bool unsensed) {
  if (distance_bound(from.placed, placed) > NearMissWatch::kAway) return;
  const double gap = signed_distance(from.placed, placed);
  if (gap > NearMissWatch::kAway) return;
  if (contacts.touched(*from.name, name) || contacts.touched(name, *from.name))
    return from.misses.touch(name, stamp_of(step));
  const Eigen::Vector2d at = nearest_point(from.placed, placed);
  const Eigen::Vector3d place(at.x(), at.y(), from.bottom - kUnderfoot);
  from.misses.near({name, pair, unsensed, place}, gap, from.moves(), stamp_of(step));
}

/// Of obstacles of the building what a contact would be said of, nearest in time.
void Simulation::State::look_at_building(const Looking& from, std::optional<Ahead>& ahead) {
  near.clear();
  const double range = from.own.local->bound + from.margin + from.speed * CollisionPrediction::kRearm;
  building->near(from.center, range, from.bottom, from.top, near);
  for (const FixedObstacle* obstacle : near) {
    if (obstacle->label == EntityLabel::stairs && from.climb > 0) {
      // The further ahead, the higher a flight may be that begins here.
      const double gap = std::max(0.0, signed_distance(from.placed, obstacle->footprint));
      if (obstacle->top < from.bottom + from.climb + kFlight * gap) continue;
    }
    const bool lost = std::any_of(doors.begin(), doors.end(), [&](const Door& door) {
      return door.handle == obstacle->handle && !door.known;
    });
    if (lost) continue;
    const PairKind pair = pair_of(from.is_virtual, obstacle->is_virtual);
    look_beside(from, obstacle->footprint, obstacle->name, pair, from.unsensed);
    if (contacts.touched(*from.name, obstacle->name)) continue;
    const double horizon = ahead ? ahead->time : CollisionPrediction::kRearm;
    const double time = time_to_contact(from.own, {&obstacle->footprint, {}, {}}, from.margin, horizon);
    if (time > horizon || (ahead && time >= ahead->time)) continue;
    const Eigen::Vector2d at = nearest_point(from.placed, obstacle->footprint);
    ahead = Ahead{obstacle->name, obstacle->relation,
                  pair,           from.unsensed,
                  time,           {at.x(), at.y(), from.bottom - kUnderfoot}};
  }
}

void Simulation::State::look_at_body(const Looking& from, const MovingFootprint& other,
                                     const Footprint& placed, const std::string& name, bool is_virtual,
                                     bool unsensed, std::optional<Ahead>& ahead) {
  if (from.speed > kClosingSpeed)
    look_beside(from, placed, name, pair_of(from.is_virtual, is_virtual), unsensed);
  const double horizon = ahead ? ahead->time : CollisionPrediction::kRearm;
  const double closing = from.speed + most_speed(other);
  if (distance_bound(from.placed, placed) - kTouch > closing * horizon) return;
  if (contacts.touched(*from.name, name) || contacts.touched(name, *from.name)) return;
  const double time = time_to_contact(from.own, other, kTouch, horizon);
  if (time > horizon || (ahead && time >= ahead->time)) return;
  const Eigen::Vector2d at = nearest_point(from.placed, placed);
  ahead = Ahead{name,     {},   pair_of(from.is_virtual, is_virtual),
                unsensed, time, {at.x(), at.y(), from.bottom - kUnderfoot}};
}

std::optional<Ahead> Simulation::State::look_ahead(const Looking& from, const Agent* self) {
  std::optional<Ahead> ahead;
  if (from.speed > kClosingSpeed) look_at_building(from, ahead);
  for (const auto& other : agents) {
    if (other.get() == self) continue;
    const double z = other->rigid.T_map_body.translation().z();
    if (z > from.top || z + other->form.size.z() < from.bottom) continue;
    const bool unsensed = self == nullptr && !(real.sensed && other->shown == AgentShown::shown);
    const bool leans = other->cable || other->rigid.T_map_body.isometry()(2, 2) <= 0.9999;
    const MovingFootprint it =
        leans ? MovingFootprint{&other->placed, {}, {}}
              : MovingFootprint{&other->form.footprint, other->pose, twist_of(other->rigid)};
    look_at_body(from, it, other->placed, other->definition.name, !other->trainee, unsensed, ahead);
  }
  if (self != nullptr && real.touchable && !self->trainee) {
    const double z = real.last.T_map_base.translation().z();
    if (z <= from.top && z + real.height >= from.bottom)
      look_at_body(from, {&real.footprint, planar_pose(real.last.T_map_base), real.last.twist}, real.placed,
                   real.name, false, !(real.sensed && self->shown == AgentShown::shown), ahead);
  }
  if (ahead)
    from.misses.ahead({ahead->object, ahead->pair, ahead->unsensed, ahead->position}, ahead->time,
                      from.moves(), stamp_of(step));
  return ahead;
}

void Simulation::State::foresee_collisions(const Looking& from, const Agent* self, const Supervised& body,
                                           const ObservedMotion& motion, Foresight& foresight) {
  foresight.misses.look(stamp_of(step));
  const std::optional<Ahead> ahead = look_ahead(from, self);
  foresight.collision.update(body, motion, from.own.twist, ahead, events);
  foresight.misses.touch_if([&](const std::string& name) {
    return contacts.touched(*from.name, name) || contacts.touched(name, *from.name);
  });
  foresight.misses.update(body, motion, events);
}

void Simulation::State::foresee_real(const ObservedMotion& motion) {
  Foresight& foresight = real.foresight;
  if (foresight.epoch != real.epoch) foresight = Foresight{};
  foresight.epoch = real.epoch;
  if (!real.touchable) return;
  const Twist2& twist = real.last.twist;
  const Supervised& body = real.watch.body();
  if (foresight.collision.due(motion.stamp, twist) || foresight.misses.leaving()) {
    const double z = motion.T_map_base.translation().z();
    const double margin =
        std::isfinite(real.last.sigma) ? std::clamp(real.last.sigma, 0.0, kMostMargin) : kMostMargin;
    const Looking from{&real.name,
                       {&real.footprint, planar_pose(motion.T_map_base), twist},
                       real.placed,
                       real.placed.center,
                       margin,
                       z + kUnderfoot,
                       z + real.height,
                       0,
                       false,
                       !real.sensed,
                       fastest_point_speed(real.footprint, twist),
                       foresight.misses};
    foresee_collisions(from, nullptr, body, motion, foresight);
  } else if (foresight.misses.open()) {
    foresight.misses.update(body, motion, events);
  }
  if (body.limits && motion.attitude_known)
    foresight.tipping.update(body, motion, foresight.trend.update(motion.T_map_base, *body.limits, dt),
                             events);
}

void Simulation::State::foresee(Agent& agent, const ObservedMotion& motion) {
  Foresight& foresight = agent.foresight;
  if (foresight.epoch != motion.epoch) foresight = Foresight{};
  foresight.epoch = motion.epoch;
  foresight.collision.stagger(static_cast<double>(agent.key % kTurns + 1) / kTurns);
  const Supervised& body = agent.watch.body();
  const Eigen::Matrix3d R_base_map = motion.T_map_base.rotation().transpose();
  const Eigen::Vector3d v = R_base_map * motion.velocity, w = R_base_map * motion.rotation_rate;
  const Twist2 twist{v.x(), v.y(), w.z()};
  const RobotModel& model = agent.robot->model();
  if (foresight.collision.due(motion.stamp, twist) || foresight.misses.leaving()) {
    const double z = motion.T_map_base.translation().z();
    // On a flight of stairs the robot leans as the flight does.
    const double lean = std::hypot(R_base_map(0, 2), R_base_map(1, 2)) / std::max(0.1, R_base_map(2, 2));
    const bool climbs = model.drive.kind == DriveKind::tracked;
    const Looking from{&agent.definition.name,
                       {&agent.form.footprint, agent.pose, twist},
                       agent.placed,
                       agent.placed.center,
                       kTouch,
                       z + kUnderfoot,
                       z + agent.form.size.z(),
                       climbs ? kMostClimb + lean * agent.form.footprint.bound : 0,
                       !agent.trainee,
                       false,
                       fastest_point_speed(agent.form.footprint, twist),
                       foresight.misses};
    foresee_collisions(from, &agent, body, motion, foresight);
  } else if (foresight.misses.open()) {
    foresight.misses.update(body, motion, events);
  }
  const Joints& joints = agent.robot->motion().joints;
  const bool same = std::equal(joints.positions.begin(), joints.positions.end(),
                               foresight.stance_joints.begin(), foresight.stance_joints.end(),
                               [](double a, double b) { return std::abs(a - b) < kSameJoints; });
  if (foresight.stance.support.empty() || !same) {
    foresight.stance = stance_of(model, joints);
    foresight.stance_joints = joints.positions;
  }
  foresight.tipping.update(body, motion, tipping_of(foresight.stance, R_base_map.col(2), w), events);
}

}  // namespace parhelion::simulation
