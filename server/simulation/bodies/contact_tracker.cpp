#include "server/simulation/bodies/contact_tracker.hpp"

#include <algorithm>

namespace parhelion::simulation {

Event ContactTracker::event_of(EventKind kind, const Contact& contact, SimulationTime now, double impulse) {
  Event event;
  event.stamp = now;
  event.kind = kind;
  event.subject = contact.newest.subject;
  event.object = contact.newest.object;
  event.pair = contact.newest.pair;
  event.position = contact.newest.position;
  event.impulse = impulse;
  event.undetectable = contact.newest.undetectable;
  event.text = contact.newest.relation;
  return event;
}

void ContactTracker::report_end(const Contact& contact, SimulationTime now, std::vector<Event>& events) {
  events.push_back(event_of(EventKind::contact_ended, contact, now, contact.peak));
}

void ContactTracker::report_continuing(Contact& contact, SimulationTime now, std::vector<Event>& events) {
  contact.peak_since_report = std::max(contact.peak_since_report, contact.newest.impulse);
  if (contact.newest.rests || (now - contact.reported).seconds() < kPeriod) return;
  events.push_back(event_of(EventKind::contact_continues, contact, now, contact.peak_since_report));
  events.back().value = (now - contact.started).seconds();
  contact.reported = now;
  contact.peak_since_report = 0;
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
      report_continuing(contact, now, events);
      continue;
    }
    contact.started = contact.reported = now;
    events.push_back(event_of(EventKind::contact_started, contact, now, pair.impulse));
  }
  for (auto entry = open_.begin(); entry != open_.end();) {
    const bool ended = (now - entry->second.last).seconds() > kPause;
    if (ended) report_end(entry->second, now, events);
    entry = ended ? open_.erase(entry) : std::next(entry);
  }
}

void ContactTracker::forget(const std::string& entity, SimulationTime now, std::vector<Event>& events) {
  for (auto entry = open_.begin(); entry != open_.end();) {
    const bool involves_entity = entry->first.first == entity || entry->first.second == entity;
    if (involves_entity) report_end(entry->second, now, events);
    entry = involves_entity ? open_.erase(entry) : std::next(entry);
  }
}

bool ContactTracker::touched(const std::string& subject, const std::string& object) const {
  return open_.contains({subject, object});
}

}  // namespace parhelion::simulation
