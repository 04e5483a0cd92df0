#include "server/simulation/events/door_events.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace parhelion::simulation {
namespace {

// Hysteresis: between the two limits the state is kept, so that a swinging door is not reported repeatedly.
constexpr double kOpened = kDoorOpened;
constexpr double kClosed = 3 * std::numbers::pi / 180;  // rad
constexpr double kLeaveGap = 0.05;                      // m beside the free space: hysteresis at its edge
constexpr double kBlame = 1.0;  // s after a touch in which events of the door are attributed to the toucher

Event door_event(EventKind kind, const Door& door, SimulationTime now, double value) {
  const bool touched = !door.toucher.name.empty() && (now - door.toucher.at).seconds() <= kBlame;
  Event event;
  event.stamp = now;
  event.kind = kind;
  event.subject = touched ? door.toucher.name : door.in_model.name;
  event.object = door.in_model.name;
  event.pair = touched ? door.toucher.pair : PairKind::none;
  event.undetectable = touched && door.toucher.undetectable;
  event.position = door.rigid.T_map_body.translation();
  event.value = value;
  event.text = door.place;
  return event;
}

/// Event of entering or leaving a door's opening.
Event pass_space(Door& door, const std::string& who, bool enters, PairKind pair, bool undetectable,
                 const Eigen::Vector3d& position, SimulationTime now) {
  const auto at = std::lower_bound(door.inside.begin(), door.inside.end(), who);
  if (enters)
    door.inside.insert(at, who);
  else
    door.inside.erase(at);
  Event event;
  event.stamp = now;
  event.kind = enters ? EventKind::door_space_entered : EventKind::door_space_left;
  event.subject = who;
  event.object = door.in_model.name;
  event.pair = pair;
  event.undetectable = undetectable;
  event.position = position;
  event.text = door.place;
  return event;
}

void watch_space(Door& door, const Surroundings& around, std::vector<Event>& events) {
  const auto is_inside = [&](const std::string& who) {
    return std::binary_search(door.inside.begin(), door.inside.end(), who);
  };
  const auto look = [&](const std::string& who, const Footprint& placed, double bottom, double top,
                        PairKind pair, bool undetectable, const Eigen::Vector3d& position) {
    const double bound = distance_bound(placed, door.space);
    if (bound > kLeaveGap && door.inside.empty()) return;
    const bool was = is_inside(who);
    const double gap = was ? kLeaveGap : 0;
    const bool level = bottom < door.space_top && top > door.space_bottom;
    const bool is = level && bound <= gap && signed_distance(placed, door.space) <= gap;
    if (is != was)
      events.push_back(pass_space(door, who, is, pair, undetectable, position, around.clock.now()));
  };
  const bool is_virtual = door.in_model.is_virtual;
  for (const Agent& agent : around.agents) {
    look(agent.definition.name, agent.placed, agent.floor + 0.02, agent.floor + agent.form.size.z(),
         is_virtual ? PairKind::virtual_virtual : PairKind::real_virtual, false,
         agent.rigid.T_map_body.translation());
  }
  for (const RealRobot& real : around.real_robots) {
    if (!real.present) continue;
    const Eigen::Vector3d p = real.last.T_map_base.translation();
    look(real.name, real.placed, p.z() + 0.02, p.z() + real.height,
         is_virtual ? PairKind::real_virtual : PairKind::real_real, !real.injection_live, p);
  }
}

}  // namespace

void watch_doors(DoorSet& doors, const std::vector<TouchingPair>& touching, const Surroundings& around,
                 Physics& physics, std::vector<Event>& events) {
  if (doors.all().empty()) return;
  const SimulationTime now = around.clock.now();
  for (const TouchingPair& pair : touching) {
    if (Door* door = doors.find(pair.object))
      door->toucher = {pair.subject, pair.pair, pair.undetectable, now};
  }
  for (Door& door : doors.all()) {
    watch_space(door, around, events);
    if (door.dynamic && !door.unhinged) {
      const double impulse = std::accumulate(door.impulses.begin(), door.impulses.end(), 0.0);
      if (door.settings.break_impulse > 0 && impulse > door.settings.break_impulse) {
        unhinge(door, physics);
        events.push_back(door_event(EventKind::door_unhinged, door, now, 0));
        events.back().impulse = impulse;
      }
    }
    if (!door.known || door.unhinged) continue;
    const double opening = std::abs(door.opening());
    if (!(door.open ? opening < kClosed : opening > kOpened)) continue;
    door.open = !door.open;
    events.push_back(
        door_event(door.open ? EventKind::door_opened : EventKind::door_closed, door, now, opening));
  }
}

}  // namespace parhelion::simulation
