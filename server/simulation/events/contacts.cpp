#include "server/simulation/events/contacts.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "server/simulation/events/pose_conflicts.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kReleaseGap = 0.02;    // m in addition to the margin: the contact with a wall has ended
constexpr double kMaxMargin = 0.10;     // m: with a larger pose uncertainty contacts are unknown
constexpr double kRests = 0.01;         // m/s
constexpr double kClosingSpeed = 0.02;  // m/s: a slower robot stands beside a wall

/// The owner of a physics body, for events.
struct Party {
  const std::string* name = nullptr;
  bool is_virtual = false;
  bool is_robot = false;                  ///< the trainee's, real or simulated
  const RealRobot* real = nullptr;        ///< if it is the real robot
  const Agent* agent = nullptr;           ///< if it is an agent
  ArticulatedRobot* robot = nullptr;      ///< if it is an articulated robot
  const std::string* relation = nullptr;  ///< if it is a part of the building
  bool is_thing = false;                  ///< does not move by itself
};

Party party(PhysicsHandle handle, Agents& agents, const RealRobots& real_robots, const Building& building) {
  for (const RealRobot& robot : real_robots) {
    if (owns(robot, handle)) return {&robot.name, false, true, &robot};
  }
  for (Agent& agent : agents) {
    if (agent.robot && agent.robot->owns(handle))
      return {&agent.definition.name, !agent.trainee, agent.trainee, nullptr, &agent, agent.robot.get()};
    if (agent.handle == handle || (agent.cable && agent.cable->owns(handle))) {
      const AgentKind kind = agent.definition.kind;
      const bool is_thing = kind != AgentKind::robot && kind != AgentKind::person;
      return {&agent.definition.name, true, false, nullptr, &agent, nullptr, nullptr, is_thing};
    }
  }
  if (const FixedObstacle* obstacle = building.by_handle(handle))
    return {&obstacle->name, obstacle->is_virtual, false, nullptr, nullptr,
            nullptr,         &obstacle->relation,  true};
  return {};
}

/// Whether the robot's sensors show the agent; null: a part of the building.
bool shows(const RealRobot& robot, const Agent* agent) {
  return robot.injection_live && (agent == nullptr || agent->seen_by[robot.index].shown == AgentShown::shown);
}

/// m/s at which the robot's motion reduces the distance to the other's outline.
double closing_speed(const RealRobot& robot, const RealRobot& other, double distance, Footprint& moved) {
  constexpr double ahead = 0.01;  // s
  place(robot.footprint, advance(planar_pose(robot.last.T_map_base), robot.last.twist, ahead), moved);
  return (distance - signed_distance(moved, other.placed)) / ahead;
}

}  // namespace

double contact_margin(const RealRobot& robot) {
  return std::isfinite(robot.last.sigma) ? std::clamp(robot.last.sigma, 0.0, kMaxMargin) : kMaxMargin;
}

void Contacts::collect_body_contacts(Agents& agents, const RealRobots& real_robots, const Building& building,
                                     const Physics& physics) {
  for (const PhysicsContact& contact : physics.contacts()) {
    Party a = party(contact.a, agents, real_robots, building);
    Party b = party(contact.b, agents, real_robots, building);
    if (!a.name || !b.name) continue;
    // The trainee's robot is the subject, then agents; the building is the object.
    const bool swap = b.is_robot || (!a.is_robot && building.by_handle(contact.a));
    if (swap) std::swap(a, b);
    for (const auto& [side, handle, shape] :
         {std::tuple(&a, swap ? contact.b : contact.a, swap ? contact.shape_b : contact.shape_a),
          std::tuple(&b, swap ? contact.a : contact.b, swap ? contact.shape_a : contact.shape_b)}) {
      if (side->robot) side->robot->touched(side->robot->link_name(handle, shape));
    }
    const bool rests = a.is_thing && b.is_thing && physics.state(contact.a).velocity.norm() < kRests &&
                       physics.state(contact.b).velocity.norm() < kRests;
    // A simulated robot's sensors are never degraded.
    if (a.real != nullptr && !a.real->touchable) continue;
    touching_.push_back({*a.name, *b.name,
                         a.is_virtual == b.is_virtual
                             ? (a.is_virtual ? PairKind::virtual_virtual : PairKind::real_real)
                             : PairKind::real_virtual,
                         contact.position, contact.impulse, a.real != nullptr && !shows(*a.real, b.agent),
                         b.relation != nullptr ? *b.relation : std::string(), rests});
  }
}

/// Bullet creates no contacts between kinematic and fixed bodies, so contact is a distance below the pose's
/// uncertainty; the impulse is the robot's mass times its closing speed.
void Contacts::collect_building_contacts(const RealRobot& robot, const Building& building) {
  if (!robot.touchable) return;
  const double margin = contact_margin(robot);
  const double z = robot.last.T_map_base.translation().z();
  near_.clear();
  building.near(robot.placed.center, robot.placed.bound + margin + kReleaseGap, z + 0.02, z + robot.height,
                near_);
  for (const FixedObstacle* obstacle : near_) {
    if (!obstacle->is_measured) continue;
    const double distance = signed_distance(robot.placed, obstacle->footprint);
    const bool open = touched(robot.name, obstacle->name);
    if (distance > margin + (open ? kReleaseGap : 0)) continue;
    place(robot.footprint, advance(planar_pose(robot.last.T_map_base), robot.last.twist, 0.01), moved_);
    const double closing = (distance - signed_distance(moved_, obstacle->footprint)) / 0.01;
    if (!open && closing < kClosingSpeed) continue;
    const Eigen::Vector2d touch = nearest_point(robot.placed, obstacle->footprint);
    touching_.push_back({robot.name,
                         obstacle->name,
                         obstacle->is_virtual ? PairKind::real_virtual : PairKind::real_real,
                         {touch.x(), touch.y(), z},
                         robot.mass * std::max(0.0, closing),
                         !robot.injection_live,
                         obstacle->relation});
  }
}

/// A thing in the gripper does not collide with it: the contact lasts as long as it is held.
void Contacts::collect_held_thing(const RealRobot& robot, const Agents& agents) {
  const Agent* thing = robot.present ? agents.find(robot.grip.held()) : nullptr;
  if (thing == nullptr) return;
  touching_.push_back({robot.name,
                       robot.grip.held(),
                       PairKind::real_virtual,
                       RealGrip::center(*robot.twin),
                       0,
                       !shows(robot, thing),
                       {},
                       true});
}

/// As with the building: the robots' bodies are kinematic, so contact is a distance below the poses'
/// uncertainty.
void Contacts::collect_robot_contact(const RealRobot& one, const RealRobot& other) {
  if (!one.touchable || !other.touchable || !overlap_in_height(one, other)) return;
  const double margin = std::min(kMaxMargin, std::hypot(contact_margin(one), contact_margin(other)));
  if (distance_bound(one.placed, other.placed) > margin + kReleaseGap) return;
  const double distance = signed_distance(one.placed, other.placed);
  const bool open = touch_each_other(one.name, other.name);
  if (distance > margin + (open ? kReleaseGap : 0) || poses_conflict(one, other)) return;
  const double by_one = closing_speed(one, other, distance, moved_);
  const double by_other = closing_speed(other, one, distance, moved_);
  if (!open && std::max(by_one, by_other) < kClosingSpeed) return;
  // The subject is the robot that drives into the other, as long as the contact lasts.
  const bool is_subject = open ? touched(one.name, other.name) : by_one >= by_other;
  const RealRobot& subject = is_subject ? one : other;
  const RealRobot& object = is_subject ? other : one;
  const Eigen::Vector2d touch = nearest_point(one.placed, other.placed);
  const double mass = one.mass * other.mass / (one.mass + other.mass);
  touching_.push_back({subject.name,
                       object.name,
                       PairKind::real_real,
                       {touch.x(), touch.y(), subject.last.T_map_base.translation().z()},
                       mass * std::max(0.0, by_one + by_other),
                       false,
                       {}});
}

void Contacts::update(Agents& agents, const RealRobots& real_robots, const Building& building,
                      const Physics& physics, SimulationTime now, std::vector<Event>& events) {
  touching_.clear();
  collect_body_contacts(agents, real_robots, building, physics);
  for (const RealRobot& robot : real_robots) {
    collect_building_contacts(robot, building);
    if (robot.twin) collect_held_thing(robot, agents);
  }
  for (std::size_t i = 0; i < real_robots.size(); ++i) {
    for (std::size_t j = i + 1; j < real_robots.size(); ++j)
      collect_robot_contact(real_robots[i], real_robots[j]);
  }
  tracker_.update(touching_, now, events);
}

}  // namespace parhelion::simulation
