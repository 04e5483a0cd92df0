// What doors do, as events: opened and closed, who comes into an opening and leaves it.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "server/simulation/state.hpp"

namespace parhelion::simulation {
namespace {

// Between the two a door is as it was: one that swings about a limit is not told again and again.
constexpr double kOpened = 10 * std::numbers::pi / 180;  // rad
constexpr double kClosed = 3 * std::numbers::pi / 180;   // rad
constexpr double kLeaveGap = 0.05;  // m beside the free space: who stands on its edge is not told again
constexpr double kBlame = 1.0;      // s after a touch in which what a door does is the toucher's doing

}  // namespace

void Simulation::State::say_door(EventKind kind, Door& door, double value) {
  const bool touched = !door.toucher.name.empty() && (stamp_of(step) - door.toucher.at).seconds() <= kBlame;
  Event event;
  event.stamp = stamp_of(step);
  event.kind = kind;
  event.subject = touched ? door.toucher.name : door.drawn.name;
  event.object = door.drawn.name;
  event.pair = touched ? door.toucher.pair : PairKind::none;
  event.unsensed = touched && door.toucher.unsensed;
  event.position = door.rigid.T_map_body.translation();
  event.value = value;
  event.text = door.place;
  events.push_back(std::move(event));
}

void Simulation::State::watch_doors() {
  if (doors.empty()) return;
  for (const TouchingPair& pair : touching) {
    if (Door* door = find_door(pair.object))
      door->toucher = {pair.subject, pair.pair, pair.unsensed, stamp_of(step)};
  }
  for (Door& door : doors) {
    watch_space(door);
    if (door.dynamic && !door.unhinged) {
      const double impulse = std::accumulate(door.impulses.begin(), door.impulses.end(), 0.0);
      if (door.settings.break_impulse > 0 && impulse > door.settings.break_impulse) unhinge(door, impulse);
    }
    if (!door.known || door.unhinged) continue;
    const double opening = std::abs(door.opening());
    if (!(door.open ? opening < kClosed : opening > kOpened)) continue;
    door.open = !door.open;
    say_door(door.open ? EventKind::door_opened : EventKind::door_closed, door, opening);
  }
}

void Simulation::State::watch_space(Door& door) {
  const auto is_inside = [&](const std::string& who) {
    return std::binary_search(door.inside.begin(), door.inside.end(), who);
  };
  const auto look = [&](const std::string& who, const Footprint& placed, double bottom, double top,
                        PairKind pair, bool unsensed, const Eigen::Vector3d& position) {
    const double bound = distance_bound(placed, door.space);
    if (bound > kLeaveGap && door.inside.empty()) return;
    const bool was = is_inside(who);
    const double gap = was ? kLeaveGap : 0;
    const bool level = bottom < door.space_top && top > door.space_bottom;
    const bool is = level && bound <= gap && signed_distance(placed, door.space) <= gap;
    if (is != was) pass_space(door, who, is, pair, unsensed, position);
  };
  const bool drawn = door.drawn.is_virtual;
  for (const auto& agent : agents) {
    look(agent->definition.name, agent->placed, agent->floor + 0.02, agent->floor + agent->form.size.z(),
         drawn ? PairKind::virtual_virtual : PairKind::real_virtual, false,
         agent->rigid.T_map_body.translation());
  }
  if (real.present) {
    const Eigen::Vector3d p = real.last.T_map_base.translation();
    look(real.name, real.placed, p.z() + 0.02, p.z() + real.height,
         drawn ? PairKind::real_virtual : PairKind::real_real, !real.sensed, p);
  }
}

void Simulation::State::pass_space(Door& door, const std::string& who, bool enters, PairKind pair,
                                   bool unsensed, const Eigen::Vector3d& position) {
  const auto at = std::lower_bound(door.inside.begin(), door.inside.end(), who);
  if (enters)
    door.inside.insert(at, who);
  else
    door.inside.erase(at);
  Event event;
  event.stamp = stamp_of(step);
  event.kind = enters ? EventKind::door_space_entered : EventKind::door_space_left;
  event.subject = who;
  event.object = door.drawn.name;
  event.pair = pair;
  event.unsensed = unsensed;
  event.position = position;
  event.text = door.place;
  events.push_back(std::move(event));
}

}  // namespace parhelion::simulation
