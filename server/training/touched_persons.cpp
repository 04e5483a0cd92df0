#include "server/training/touched_persons.hpp"

#include <algorithm>
#include <sstream>

namespace parhelion::training {

void TouchedPersons::take(const WorldMessage& world) {
  if (world.robot == names_) return;
  names_ = world.robot;
  std::istringstream names(names_);
  for (std::string name; names >> name;) trainees_robots_.insert(name);
}

bool TouchedPersons::take(const Event& event) {
  if (event.kind == EventKind::operator_switched) {
    note(drives_, event);
    if (event.object == robot_ || trainees_robots_.contains(event.object)) note(home_, event);
  }
  if (event.kind == EventKind::console_lost) drives_.erase(event.subject);
  return event.kind == EventKind::person_touched && !event.undetectable &&
         (event.subject == robot_ || is_of_its_trainee(event.subject));
}

void TouchedPersons::note(std::map<std::string, std::string>& robots, const Event& switched) {
  if (robots.size() >= kMaxOperators && !robots.contains(switched.subject)) return;
  robots[switched.subject] = switched.object;
}

bool TouchedPersons::is_of_its_trainee(const std::string& robot) const {
  if (trainees_robots_.contains(robot)) return false;
  return std::any_of(drives_.begin(), drives_.end(), [&](const auto& each) {
    if (each.second != robot) return false;
    const auto home = home_.find(each.first);
    return home == home_.end() || home->second == robot_;
  });
}

}  // namespace parhelion::training
