#include "server/simulation/events/predictor.hpp"

#include <algorithm>
#include <cmath>

#include "server/simulation/events/pose_conflicts.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kTouch = 0.001;        // m: a smaller distance is contact
constexpr double kUnderfoot = 0.02;     // m over base_link: lower obstacles are driven over
constexpr double kMaxClimb = 0.30;      // m: tracks climb steps up to this height
constexpr double kFlight = 0.8;         // slope of the steepest stairs
constexpr double kClosingSpeed = 0.02;  // m/s: slower, it counts as standing
constexpr std::uint64_t kTurns = 4;     // robots take turns over so many steps
constexpr double kSameJoints = 0.005;   // rad and m: smaller changes keep the stance

Twist2 twist_of(const RigidState& rigid) {
  const Eigen::Vector3d v = rigid.T_map_body.rotation().transpose() * rigid.velocity;
  return {v.x(), v.y(), rigid.rotation_rate.z()};
}

/// Upper bound of the speed of all its points, m/s.
double max_speed(const MovingFootprint& it) {
  const double reach = it.local->center.norm() + it.local->bound;
  return std::sqrt(it.twist.vx * it.twist.vx + it.twist.vy * it.twist.vy) + std::abs(it.twist.wz) * reach;
}

PairKind pair_of(bool a_virtual, bool b_virtual) {
  if (a_virtual != b_virtual) return PairKind::real_virtual;
  return a_virtual ? PairKind::virtual_virtual : PairKind::real_real;
}

/// For a simulated robot, from its current stance.
void predict_tipping(Agent& agent, const ObservedMotion& motion, const Eigen::Matrix3d& R_base_map,
                     const Eigen::Vector3d& w, std::vector<Event>& events) {
  RobotPrediction& prediction = agent.prediction;
  const Joints& joints = agent.robot->motion().joints;
  const bool same = std::equal(joints.positions.begin(), joints.positions.end(),
                               prediction.stance_joints.begin(), prediction.stance_joints.end(),
                               [](double a, double b) { return std::abs(a - b) < kSameJoints; });
  if (prediction.stance.support.empty() || !same) {
    prediction.stance = stance_of(agent.robot->model(), joints);
    prediction.stance_joints = joints.positions;
  }
  prediction.tipping.update(agent.watch.body(), motion, tipping_of(prediction.stance, R_base_map.col(2), w),
                            events);
}

}  // namespace

/// Objects close enough to become a near miss.
void Predictor::check_passing_distance(const PredictionQuery& query, const Footprint& placed,
                                       const std::string& name, PairKind pair, bool undetectable) {
  if (distance_bound(query.placed, placed) > NearMissWatch::kAway) return;
  const double gap = signed_distance(query.placed, placed);
  if (gap > NearMissWatch::kAway) return;
  if (query.contacts.touch_each_other(*query.name, name)) return query.misses.touch(name, query.now());
  const Eigen::Vector2d at = nearest_point(query.placed, placed);
  const Eigen::Vector3d place(at.x(), at.y(), query.bottom - kUnderfoot);
  query.misses.near({name, pair, undetectable, place}, gap, query.moves(), query.now());
}

/// The obstacle of the building that it would touch first.
void Predictor::predict_building_collision(const PredictionQuery& query, std::optional<Ahead>& ahead) {
  const auto& doors = query.around.environment.doors.all();
  near_.clear();
  const double range = query.own.local->bound + query.margin + query.speed * CollisionPrediction::kRearm;
  query.around.building().near(query.center, range, query.bottom, query.top, near_);
  for (const FixedObstacle* obstacle : near_) {
    if (obstacle->label == EntityLabel::stairs && query.climb > 0) {
      // The farther ahead, the higher a flight of stairs that begins here may be.
      const double gap = std::max(0.0, signed_distance(query.placed, obstacle->footprint));
      if (obstacle->top < query.bottom + query.climb + kFlight * gap) continue;
    }
    const bool lost = std::any_of(doors.begin(), doors.end(), [&](const Door& door) {
      return door.handle == obstacle->handle && !door.known;
    });
    if (lost) continue;
    const PairKind pair = pair_of(query.is_virtual, obstacle->is_virtual);
    check_passing_distance(query, obstacle->footprint, obstacle->name, pair, query.undetectable);
    if (query.contacts.touched(*query.name, obstacle->name)) continue;
    const double horizon = ahead ? ahead->time : CollisionPrediction::kRearm;
    const double time = time_to_contact(query.own, {&obstacle->footprint, {}, {}}, query.margin, horizon);
    if (time > horizon || (ahead && time >= ahead->time)) continue;
    const Eigen::Vector2d at = nearest_point(query.placed, obstacle->footprint);
    ahead = Ahead{obstacle->name, obstacle->relation,
                  pair,           query.undetectable,
                  time,           {at.x(), at.y(), query.bottom - kUnderfoot}};
  }
}

void Predictor::predict_body_collision(const PredictionQuery& query, const OtherBody& other,
                                       std::optional<Ahead>& ahead) {
  const PairKind pair = pair_of(query.is_virtual, other.is_virtual);
  if (query.speed > kClosingSpeed)
    check_passing_distance(query, other.placed, other.name, pair, other.undetectable);
  const double horizon = ahead ? ahead->time : CollisionPrediction::kRearm;
  const double closing = query.speed + max_speed(other.moving);
  if (distance_bound(query.placed, other.placed) - kTouch > closing * horizon) return;
  if (query.contacts.touch_each_other(*query.name, other.name)) return;
  const double time = time_to_contact(query.own, other.moving, kTouch, horizon);
  if (time > horizon || (ahead && time >= ahead->time)) return;
  const Eigen::Vector2d at = nearest_point(query.placed, other.placed);
  ahead = Ahead{other.name, {}, pair, other.undetectable, time, {at.x(), at.y(), query.bottom - kUnderfoot}};
}

void Predictor::predict_agent_collision(const PredictionQuery& query, const Agent& other,
                                        std::optional<Ahead>& ahead) {
  if (&other == query.agent) return;
  const double z = other.rigid.T_map_body.translation().z();
  if (z > query.top || z + other.form.size.z() < query.bottom) return;
  const bool undetectable =
      query.real != nullptr &&
      !(query.real->injection_live && other.seen_by[query.real->index].shown == AgentShown::shown);
  const bool leans = other.cable || other.rigid.T_map_body.isometry()(2, 2) <= 0.9999;
  const MovingFootprint moving =
      leans ? MovingFootprint{&other.placed, {}, {}}
            : MovingFootprint{&other.form.footprint, other.pose, twist_of(other.rigid)};
  predict_body_collision(query, {moving, other.placed, other.definition.name, !other.trainee, undetectable},
                         ahead);
}

void Predictor::predict_real_collision(const PredictionQuery& query, const RealRobot& other,
                                       std::optional<Ahead>& ahead) {
  if (!other.touchable || &other == query.real || (query.agent != nullptr && query.agent->trainee)) return;
  if (query.real != nullptr && poses_conflict(*query.real, other)) return;
  const double z = other.last.T_map_base.translation().z();
  if (z > query.top || z + other.height < query.bottom) return;
  // Two real robots see each other whatever is injected.
  const bool undetectable =
      query.agent != nullptr &&
      !(other.injection_live && query.agent->seen_by[other.index].shown == AgentShown::shown);
  const MovingFootprint moving{&other.footprint, planar_pose(other.last.T_map_base), other.last.twist};
  predict_body_collision(query, {moving, other.placed, other.name, false, undetectable}, ahead);
}

std::optional<Ahead> Predictor::find_first_collision(const PredictionQuery& query) {
  std::optional<Ahead> ahead;
  if (query.speed > kClosingSpeed) predict_building_collision(query, ahead);
  for (const Agent& other : query.around.agents) predict_agent_collision(query, other, ahead);
  for (const RealRobot& other : query.around.real_robots) predict_real_collision(query, other, ahead);
  if (ahead)
    query.misses.ahead({ahead->object, ahead->pair, ahead->undetectable, ahead->position}, ahead->time,
                       query.moves(), query.now());
  return ahead;
}

void Predictor::predict_collisions(const PredictionQuery& query, const Supervised& body,
                                   const ObservedMotion& motion, RobotPrediction& prediction,
                                   std::vector<Event>& events) {
  prediction.misses.begin_check(query.now());
  const std::optional<Ahead> ahead = find_first_collision(query);
  prediction.collision.update(body, motion, query.own.twist, ahead, events);
  prediction.misses.touch_if(
      [&](const std::string& name) { return query.contacts.touch_each_other(*query.name, name); });
  prediction.misses.update(body, motion, events);
}

void Predictor::predict(RealRobot& robot, const ObservedMotion& motion, const Surroundings& around,
                        const Contacts& contacts, std::vector<Event>& events) {
  RobotPrediction& prediction = robot.prediction;
  if (prediction.epoch != robot.epoch) prediction = RobotPrediction{};
  prediction.epoch = robot.epoch;
  if (!robot.touchable) return;
  const Twist2& twist = robot.last.twist;
  const Supervised& body = robot.watch.body();
  if (prediction.collision.due(motion.stamp, twist) || prediction.misses.leaving()) {
    const double z = motion.T_map_base.translation().z();
    const PredictionQuery query{.name = &robot.name,
                                .own = {&robot.footprint, planar_pose(motion.T_map_base), twist},
                                .placed = robot.placed,
                                .center = robot.placed.center,
                                .margin = contact_margin(robot),
                                .bottom = z + kUnderfoot,
                                .top = z + robot.height,
                                .climb = 0,
                                .is_virtual = false,
                                .undetectable = !robot.injection_live,
                                .speed = fastest_point_speed(robot.footprint, twist),
                                .real = &robot,
                                .agent = nullptr,
                                .misses = prediction.misses,
                                .around = around,
                                .contacts = contacts};
    predict_collisions(query, body, motion, prediction, events);
  } else if (prediction.misses.open()) {
    prediction.misses.update(body, motion, events);
  }
  if (body.limits && motion.attitude_known)
    prediction.tipping.update(
        body, motion, prediction.trend.update(motion.T_map_base, *body.limits, around.clock.dt), events);
}

void Predictor::predict(Agent& agent, const ObservedMotion& motion, const Surroundings& around,
                        const Contacts& contacts, std::vector<Event>& events) {
  RobotPrediction& prediction = agent.prediction;
  if (prediction.epoch != motion.epoch) prediction = RobotPrediction{};
  prediction.epoch = motion.epoch;
  prediction.collision.stagger(static_cast<double>(agent.name_hash % kTurns + 1) / kTurns);
  const Supervised& body = agent.watch.body();
  const Eigen::Matrix3d R_base_map = motion.T_map_base.rotation().transpose();
  const Eigen::Vector3d v = R_base_map * motion.velocity, w = R_base_map * motion.rotation_rate;
  const Twist2 twist{v.x(), v.y(), w.z()};
  const RobotModel& model = agent.robot->model();
  if (prediction.collision.due(motion.stamp, twist) || prediction.misses.leaving()) {
    const double z = motion.T_map_base.translation().z();
    // On a flight of stairs the robot is inclined like the flight.
    const double lean = std::hypot(R_base_map(0, 2), R_base_map(1, 2)) / std::max(0.1, R_base_map(2, 2));
    const bool climbs = model.drive.kind == DriveKind::tracked;
    const PredictionQuery query{.name = &agent.definition.name,
                                .own = {&agent.form.footprint, agent.pose, twist},
                                .placed = agent.placed,
                                .center = agent.placed.center,
                                .margin = kTouch,
                                .bottom = z + kUnderfoot,
                                .top = z + agent.form.size.z(),
                                .climb = climbs ? kMaxClimb + lean * agent.form.footprint.bound : 0,
                                .is_virtual = !agent.trainee,
                                .undetectable = false,
                                .speed = fastest_point_speed(agent.form.footprint, twist),
                                .real = nullptr,
                                .agent = &agent,
                                .misses = prediction.misses,
                                .around = around,
                                .contacts = contacts};
    predict_collisions(query, body, motion, prediction, events);
  } else if (prediction.misses.open()) {
    prediction.misses.update(body, motion, events);
  }
  predict_tipping(agent, motion, R_base_map, w, events);
}

}  // namespace parhelion::simulation
