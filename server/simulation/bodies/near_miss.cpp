#include "server/simulation/bodies/near_miss.hpp"

#include <algorithm>

namespace parhelion::simulation {
namespace {

constexpr double kVerge = 0.05;  // m and s from the limits of kAway: may be exceeded within some steps

}  // namespace

bool NearMissWatch::leaving() const {
  return std::any_of(open_.begin(), open_.end(),
                     [&](const auto& each) { return each.second.seen == checked_at_ && !each.second.stays; });
}

NearMissWatch::Encounter& NearMissWatch::meet(const Neighbour& thing, SimulationTime now) {
  auto at = open_.find(thing.name);
  if (at == open_.end()) at = open_.emplace(std::string(thing.name), Encounter{}).first;
  Encounter& encounter = at->second;
  encounter.pair = thing.pair;
  encounter.undetectable = encounter.undetectable || thing.undetectable;
  encounter.stays = encounter.stays && encounter.seen == now;
  encounter.seen = now;
  return encounter;
}

void NearMissWatch::near(const Neighbour& thing, double gap, bool moves, SimulationTime now) {
  Encounter& encounter = meet(thing, now);
  encounter.came = encounter.came || gap > kGap;
  encounter.stays = encounter.stays || gap < kAway - kVerge;
  if (moves && encounter.came && gap < encounter.gap.value) encounter.gap = {gap, thing.position};
}

void NearMissWatch::ahead(const Neighbour& thing, double time, bool moves, SimulationTime now) {
  if (time > kTimeAway) return;
  Encounter& encounter = meet(thing, now);
  encounter.stays = encounter.stays || time < kTimeAway - kVerge;
  if (moves && time < encounter.time.value) encounter.time = {time, thing.position};
}

void NearMissWatch::touch(std::string_view name, SimulationTime now) { meet({name}, now).touched = true; }

void NearMissWatch::update(const Supervised& body, const ObservedMotion& motion, std::vector<Event>& events) {
  const auto report = [&](const auto& each, const Closest& closest, double threshold, const char* by) {
    if (each.second.touched || !(closest.value <= threshold)) return;
    Event event = event_of(EventKind::near_miss, body, motion, closest.value);
    event.object = each.first;
    event.pair = each.second.pair;
    event.undetectable = each.second.undetectable;
    event.position = closest.position;
    event.text = by;
    events.push_back(std::move(event));
  };
  std::erase_if(open_, [&](const auto& each) {
    if ((motion.stamp - each.second.seen).seconds() <= kHold) return false;
    report(each, each.second.gap, kGap, "gap");
    report(each, each.second.time, kTime, "time");
    return true;
  });
}

}  // namespace parhelion::simulation
