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
    note(event);
  }
  if (const auto known = operators_.find(event.subject);
      event.kind == EventKind::console_lost && known != operators_.end())
    known->second.drives.clear();
  return event.kind == EventKind::person_touched && !event.undetectable &&
         (event.subject == robot_ || is_of_its_trainee(event.subject));
}

void TouchedPersons::note(const Event& switched) {
  if (operators_.size() >= kMaxOperators && !operators_.contains(switched.subject)) {
    const auto idle = std::find_if(operators_.begin(), operators_.end(),
                                   [](const auto& each) { return each.second.drives.empty(); });
    if (idle == operators_.end()) return;
    operators_.erase(idle);
  }
  Operator& known = operators_[switched.subject];
  known.drives = switched.object;
  if (switched.object == robot_ || trainees_robots_.contains(switched.object)) known.home = switched.object;
}

bool TouchedPersons::is_of_its_trainee(const std::string& robot) const {
  if (trainees_robots_.contains(robot)) return false;
  return std::any_of(operators_.begin(), operators_.end(), [&](const auto& each) {
    const Operator& known = each.second;
    return known.drives == robot && (known.home.empty() || known.home == robot_);
  });
}

}  // namespace parhelion::training
