#include "server/simulation/contacts.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "server/simulation/state.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kReleaseGap = 0.02;    // m more than the margin: the robot has left a wall
constexpr double kMostMargin = 0.10;    // m: a pose that is known worse says nothing about contacts
constexpr double kRests = 0.01;         // m/s
constexpr double kClosingSpeed = 0.02;  // m/s: slower, a robot stands beside a wall rather than hits it

}  // namespace

Event ContactTracker::event_of(EventKind kind, const Contact& contact, SimulationTime now, double impulse) {
  Event event;
  event.stamp = now;
  event.kind = kind;
  event.subject = contact.newest.subject;
  event.object = contact.newest.object;
  event.pair = contact.newest.pair;
  event.position = contact.newest.position;
  event.impulse = impulse;
  event.unsensed = contact.newest.unsensed;
  event.text = contact.newest.relation;
  return event;
}

void ContactTracker::stop(const Contact& contact, SimulationTime now, std::vector<Event>& events) {
  events.push_back(event_of(EventKind::collision_stopped, contact, now, contact.peak));
}

void ContactTracker::go_on(Contact& contact, SimulationTime now, std::vector<Event>& events) {
  contact.peak_said = std::max(contact.peak_said, contact.newest.impulse);
  if (contact.newest.rests || (now - contact.said).seconds() < kPeriod) return;
  events.push_back(event_of(EventKind::collision_continued, contact, now, contact.peak_said));
  events.back().value = (now - contact.started).seconds();
  contact.said = now;
  contact.peak_said = 0;
}

void ContactTracker::update(const std::vector<TouchingPair>& touching, SimulationTime now,
                            std::vector<Event>& events) {
  for (const TouchingPair& pair : touching) {
    const auto [entry, is_new] = open_.try_emplace({pair.subject, pair.object});
    Contact& contact = entry->second;
    contact.newest = pair;
    contact.peak = std::max(contact.peak, pair.impulse);
    contact.last = now;
    if (!is_new) {
      go_on(contact, now, events);
      continue;
    }
    contact.started = contact.said = now;
    events.push_back(event_of(EventKind::collision_started, contact, now, pair.impulse));
  }
  for (auto entry = open_.begin(); entry != open_.end();) {
    const bool ended = (now - entry->second.last).seconds() > kPause;
    if (ended) stop(entry->second, now, events);
    entry = ended ? open_.erase(entry) : std::next(entry);
  }
}

void ContactTracker::forget(const std::string& entity, SimulationTime now, std::vector<Event>& events) {
  for (auto entry = open_.begin(); entry != open_.end();) {
    const bool its = entry->first.first == entity || entry->first.second == entity;
    if (its) stop(entry->second, now, events);
    entry = its ? open_.erase(entry) : std::next(entry);
  }
}

bool ContactTracker::touched(const std::string& subject, const std::string& object) const {
  return open_.contains({subject, object});
}

namespace {

/// Who a physics body is, for an event.
struct Party {
  const std::string* name = nullptr;
  bool is_virtual = false;
  bool is_real_robot = false;
  bool shown = true;
  Agent* robot = nullptr;                 ///< an articulated one
  const std::string* relation = nullptr;  ///< of a part of the building
  bool is_thing = false;                  ///< it does not move by itself
};

Party party(const auto& state, PhysicsHandle handle) {
  if (handle == state.real.handle) return {&state.real.name, false, true};
  for (const auto& agent : state.agents) {
    if (agent->robot && agent->robot->owns(handle))
      return {&agent->definition.name,           !agent->trainee, agent->trainee,
              agent->shown == AgentShown::shown, agent.get(),     nullptr};
    if (agent->handle == handle || (agent->cable && agent->cable->owns(handle))) {
      const AgentKind kind = agent->definition.kind;
      return {&agent->definition.name,
              true,
              false,
              agent->shown == AgentShown::shown,
              nullptr,
              nullptr,
              kind != AgentKind::robot && kind != AgentKind::person};
    }
  }
  if (const FixedObstacle* obstacle = state.building->by_handle(handle)) {
    return {&obstacle->name, obstacle->is_virtual, false, true, nullptr, &obstacle->relation, true};
  }
  return {};
}

}  // namespace

void Simulation::State::collect_body_contacts() {
  for (const PhysicsContact& contact : physics.contacts()) {
    Party a = party(*this, contact.a), b = party(*this, contact.b);
    if (!a.name || !b.name) continue;
    // The real robot is the subject, then agents; the building is the object.
    const bool swap = b.is_real_robot || (!a.is_real_robot && building->by_handle(contact.a));
    if (swap) std::swap(a, b);
    const bool with_robot = a.is_real_robot;
    for (const auto& [side, handle, shape] :
         {std::tuple(&a, swap ? contact.b : contact.a, swap ? contact.shape_b : contact.shape_a),
          std::tuple(&b, swap ? contact.a : contact.b, swap ? contact.shape_a : contact.shape_b)}) {
      if (side->robot) side->robot->robot->touched(side->robot->robot->link_name(handle, shape));
    }
    const bool rests = a.is_thing && b.is_thing && physics.state(contact.a).velocity.norm() < kRests &&
                       physics.state(contact.b).velocity.norm() < kRests;
    const bool simulated = a.robot && a.is_real_robot;  // the trainee's: its sensors are never degraded
    if (with_robot && !simulated && !real.touchable) continue;
    touching.push_back(
        {*a.name, *b.name,
         a.is_virtual == b.is_virtual ? (a.is_virtual ? PairKind::virtual_virtual : PairKind::real_real)
                                      : PairKind::real_virtual,
         contact.position, contact.impulse, with_robot && !simulated && !(real.sensed && b.shown),
         b.relation != nullptr ? *b.relation : std::string(), rests});
  }
}

/// Bullet makes no contact between a kinematic and a fixed body, so this is a distance with the pose's own
/// uncertainty as margin; the impulse is what stops the robot's mass at its closing speed.
void Simulation::State::collect_building_contacts() {
  if (!real.touchable) return;
  const double margin =
      std::isfinite(real.last.sigma) ? std::clamp(real.last.sigma, 0.0, kMostMargin) : kMostMargin;
  const double z = real.last.T_map_base.translation().z();
  near.clear();
  building->near(real.placed.center, real.placed.bound + margin + kReleaseGap, z + 0.02, z + real.height,
                 near);
  for (const FixedObstacle* obstacle : near) {
    if (!obstacle->is_measured) continue;
    const double distance = signed_distance(real.placed, obstacle->footprint);
    const bool open = contacts.touched(real.name, obstacle->name);
    if (distance > margin + (open ? kReleaseGap : 0)) continue;
    place(real.footprint, advance(planar_pose(real.last.T_map_base), real.last.twist, 0.01), moved_real);
    const double closing = (distance - signed_distance(moved_real, obstacle->footprint)) / 0.01;
    if (!open && closing < kClosingSpeed) continue;
    const Eigen::Vector2d touch = nearest_point(real.placed, obstacle->footprint);
    touching.push_back({real.name,
                        obstacle->name,
                        obstacle->is_virtual ? PairKind::real_virtual : PairKind::real_real,
                        {touch.x(), touch.y(), z},
                        real.mass * std::max(0.0, closing),
                        !real.sensed,
                        obstacle->relation});
  }
}

void Simulation::State::track_contacts() {
  touching.clear();
  collect_body_contacts();
  collect_building_contacts();
  contacts.update(touching, stamp_of(step), events);
}

}  // namespace parhelion::simulation
