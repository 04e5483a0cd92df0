#include "tests/fusion/people/evaluation.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "protocols/quantile.hpp"

namespace parhelion::test {
namespace {

struct Pair {
  double distance;
  std::size_t person, mover;
  bool operator<(const Pair& other) const {
    return std::tie(distance, person, mover) < std::tie(other.distance, other.person, other.mover);
  }
};

}  // namespace

void PeopleScore::add(std::span<const people::Mover> movers, std::span<const KnownPerson> people,
                      bool complete, double dt) {
  minutes += dt / 60;
  std::vector<const people::Mover*> persons;
  for (const people::Mover& mover : movers)
    if (mover.kind == people::MoverClass::person && mover.stamp - mover.seen <= seconds(0.5))
      persons.push_back(&mover);
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < people.size(); ++i) {
    for (std::size_t j = 0; j < persons.size(); ++j) {
      const double distance = (people[i].position - persons[j]->position).norm();
      // The track of before comes first, as in the CLEAR MOT metrics.
      const auto before = known_.find(people[i].id);
      const bool same = before != known_.end() && before->second.track == persons[j]->id;
      if (distance <= kRadius) pairs.push_back({same ? distance - 10 : distance, i, j});
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<const people::Mover*> found_by(people.size(), nullptr);
  std::vector<char> used(persons.size(), 0);
  for (const Pair& pair : pairs) {
    if (found_by[pair.person] != nullptr || used[pair.mover] != 0) continue;
    found_by[pair.person] = persons[pair.mover];
    used[pair.mover] = 1;
  }
  for (std::size_t i = 0; i < people.size(); ++i) match(people[i], found_by[i], dt);
  if (!complete) return;
  reported += static_cast<int>(persons.size());
  right += static_cast<int>(std::count(used.begin(), used.end(), 1));
}

void PeopleScore::skip(double dt) {
  for (auto& [id, known] : known_) {
    known.unseen += dt;
    if (known.unseen > kGone) known.track = 0;
  }
}

void PeopleScore::match(const KnownPerson& person, const people::Mover* best, double dt) {
  Known& known = known_[person.id];
  known.unseen = person.counted ? 0 : known.unseen + dt;
  if (known.unseen > kGone) known.track = 0;
  if (person.counted) {
    ++wanted;
    person_minutes += dt / 60;
    if (!known.found) known.visible += dt;
  }
  if (best == nullptr) return;
  if (person.counted) {
    ++found;
    errors.push_back((best->position - person.position).norm());
    if (!known.found) first.push_back(known.visible);
    known.found = true;
  }
  if (known.track != 0 && known.track != best->id) ++switches;
  known.track = best->id;
}

void PeopleScore::finish() {
  for (const auto& [id, known] : known_)
    if (!known.found && known.visible > 0.5) first.push_back(known.visible);
  known_.clear();
}

PeopleScore& PeopleScore::operator+=(const PeopleScore& other) {
  wanted += other.wanted;
  found += other.found;
  reported += other.reported;
  right += other.right;
  switches += other.switches;
  minutes += other.minutes;
  person_minutes += other.person_minutes;
  errors.insert(errors.end(), other.errors.begin(), other.errors.end());
  first.insert(first.end(), other.first.begin(), other.first.end());
  return *this;
}

double PeopleScore::rms_error() const {
  double sum = 0;
  for (const double error : errors) sum += error * error;
  return errors.empty() ? 0 : std::sqrt(sum / static_cast<double>(errors.size()));
}

double PeopleScore::error_quantile(double q) const {
  std::vector<double> sorted = errors;
  return sorted.empty() ? 0 : quantile(sorted, q);
}

double PeopleScore::first_detection(double q) const {
  std::vector<double> sorted = first;
  return sorted.empty() ? 0 : quantile(sorted, q);
}

}  // namespace parhelion::test
