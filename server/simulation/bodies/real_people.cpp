#include "server/simulation/bodies/real_people.hpp"

#include <algorithm>
#include <cmath>

#include "server/simulation/bodies/bodies.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kMaxPrediction = 0.5;  // s
constexpr double kMargin = 0.2;         // m kept to a person
constexpr double kStandsStill = 0.05;   // m/s
constexpr double kLookAhead = 8;        // m: farther people do not matter
constexpr double kWalks = 0.3;          // m/s: from here on the velocity says where somebody faces
constexpr const char* kPrefix = "real person ";
/// Beside virtual persons, whose clothes have other colours. Linear RGB.
const Eigen::Vector3f kColour{0.90F, 0.08F, 0.32F};

std::vector<Shape> make_figure() {
  AgentDefinition person;
  person.kind = AgentKind::person;
  std::vector<Transform<Base, Body>> poses;
  part_poses(person, {}, poses);
  std::vector<Shape> figure;
  const std::vector<BodyDefinition> parts = agent_bodies(person, 1);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    for (Shape shape : parts[i].shapes) {
      shape.T_body_shape =
          Transform<Body, ShapeFrame>(Eigen::Isometry3d(poses[i].isometry() * shape.T_body_shape.isometry()));
      shape.material.albedo = kColour;
      figure.push_back(std::move(shape));
    }
  }
  return figure;
}

std::shared_ptr<const BodyDefinition> define(const RealPerson& person) {
  return std::make_shared<const BodyDefinition>(BodyDefinition{kFirstPersonBody + person.id, name_of(person),
                                                               "body", BodyOwner::real_person, false,
                                                               real_person_shapes()});
}

/// `later`: s after its stamp.
void put(const RealPerson& person, double later, PlacedPerson& placed) {
  placed.velocity = person.velocity;
  if (person.velocity.norm() > kWalks) placed.yaw = std::atan2(person.velocity.y(), person.velocity.x());
  placed.sigma = std::sqrt(std::max(0.0, person.covariance.trace() / 2)) + later * kWalks;
  placed.disc.vertices[0] = person.position + later * person.velocity;
  placed.disc.radius = person.radius;
  placed.disc.update_bound();
}

}  // namespace

const std::vector<Shape>& real_person_shapes() {
  static const std::vector<Shape> figure = make_figure();
  return figure;
}

std::string name_of(const RealPerson& person) { return kPrefix + std::to_string(person.id); }

bool names_real_person(std::string_view entity) { return entity.starts_with(kPrefix); }

bool RealPeople::set(const std::vector<RealPerson>& people) {
  const bool same = people.size() == people_.size() &&
                    std::equal(people.begin(), people.end(), people_.begin(),
                               [](const RealPerson& a, const RealPerson& b) { return a.id == b.id; });
  people_ = people;
  if (!same) {
    std::vector<PlacedPerson> placed;
    for (const RealPerson& person : people_) {
      const auto known = std::find_if(placed_.begin(), placed_.end(),
                                      [&](const PlacedPerson& each) { return each.id == person.id; });
      if (known != placed_.end()) {
        placed.push_back(*known);
      } else {
        placed.push_back({person.id, define(person), make_disc({0, 0}, 0), 0, {0, 0}, 0});
      }
    }
    placed_.swap(placed);
  }
  for (std::size_t i = 0; i < people_.size(); ++i) put(people_[i], 0, placed_[i]);
  return !same;
}

void RealPeople::place(SimulationTime now) {
  for (std::size_t i = 0; i < people_.size(); ++i)
    put(people_[i], std::clamp((now - people_[i].stamp).seconds(), 0.0, kMaxPrediction), placed_[i]);
}

/// An agent or a real robot.
struct RealPeople::Mover {
  const std::string& name;
  const Footprint& placed;
  PairKind pair;
  Eigen::Vector2d origin, velocity;  ///< m, m/s, map
  double turn_rate, floor, mass, sigma;

  /// m/s, of the point `p` (map) towards `there`.
  double speed_towards(const Eigen::Vector2d& p, const Eigen::Vector2d& there) const {
    const Eigen::Vector2d arm = p - origin, towards = there - origin;
    const Eigen::Vector2d v = velocity + turn_rate * Eigen::Vector2d(-arm.y(), arm.x());
    return towards.norm() > 1e-6 ? v.dot(towards.normalized()) : v.norm();
  }
};

void RealPeople::look(const Mover& mover, SimulationTime now, std::vector<Event>& events) {
  for (const PlacedPerson& person : placed_) {
    if (distance_bound(mover.placed, person.disc) > 0) continue;
    // Where both places are known so well that they do touch.
    if (signed_distance(mover.placed, person.disc) >
        -std::min(mover.sigma + person.sigma, person.disc.radius))
      continue;
    const Eigen::Vector2d p = nearest_point(mover.placed, person.disc);
    const double speed = mover.speed_towards(p, person.disc.center);
    TouchingPair pair;
    pair.subject = mover.name;
    pair.object = person.definition->entity;
    pair.pair = mover.pair;
    pair.position << p, mover.floor;
    pair.impulse = mover.mass * std::max(speed, 0.0);
    pair.undetectable = speed < kStandsStill;
    touching_.push_back(pair);
    if (pair.undetectable || !blamed_.emplace(pair.subject, pair.object).second) continue;
    Event event;
    event.stamp = now;
    event.kind = EventKind::person_touched;
    event.subject = pair.subject;
    event.object = pair.object;
    event.pair = pair.pair;
    event.position = pair.position;
    event.impulse = pair.impulse;
    event.value = speed;
    events.push_back(std::move(event));
  }
}

void RealPeople::report_contacts(const Agents& agents, const RealRobots& robots, SimulationTime now,
                                 std::vector<Event>& events) {
  touching_.clear();
  for (const Agent& agent : agents)
    look({agent.definition.name, agent.placed, PairKind::real_virtual, agent.pose.position(),
          agent.rigid.velocity.head<2>(), agent.rigid.rotation_rate.z(), agent.floor, agent.form.mass, 0},
         now, events);
  for (const RealRobot& robot : robots) {
    if (!robot.touchable) continue;
    const Eigen::Isometry3d& base = robot.last.T_map_base.isometry();
    const Eigen::Vector3d velocity =
        base.linear() * Eigen::Vector3d(robot.last.twist.vx, robot.last.twist.vy, 0);
    look({robot.name, robot.placed, PairKind::real_real, base.translation().head<2>(), velocity.head<2>(),
          robot.last.twist.wz, base.translation().z(), robot.mass, robot.last.sigma},
         now, events);
  }
  contacts_.update(touching_, now, events);
  std::erase_if(blamed_, [this](const auto& each) { return !contacts_.touched(each.first, each.second); });
}

Twist2 slowed_for_people(const Agent& agent, const Twist2& wanted, const RealPeople& people) {
  const double speed = std::hypot(wanted.vx, wanted.vy);
  if (people.placed().empty() || speed < 1e-6) return wanted;
  const double c = std::cos(agent.pose.yaw), s = std::sin(agent.pose.yaw);
  const Eigen::Vector2d velocity(c * wanted.vx - s * wanted.vy, s * wanted.vx + c * wanted.vy);
  const double deceleration = limits_of(agent).acceleration;
  double scale = 1;
  for (const PlacedPerson& person : people.placed()) {
    const Eigen::Vector2d offset = person.disc.center - agent.pose.position();
    const double distance = offset.norm();
    const double closing = distance > 1e-6 ? velocity.dot(offset) / distance : speed;
    if (closing <= 0 || distance_bound(agent.placed, person.disc) > kLookAhead) continue;
    // Passing by: the person's disc is outside the strip that the agent drives over.
    const double aside = std::abs(velocity.x() * offset.y() - velocity.y() * offset.x()) / speed;
    if (aside > agent.placed.bound + person.disc.radius + kMargin) continue;
    const double gap = std::max(signed_distance(agent.placed, person.disc) - kMargin, 0.0);
    scale = std::min(scale, std::sqrt(2 * deceleration * gap) / closing);
  }
  return {scale * wanted.vx, scale * wanted.vy, scale * wanted.wz};
}

}  // namespace parhelion::simulation
