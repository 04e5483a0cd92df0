#include "fusion/people/fused_people.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <iterator>

#include "fusion/people/fused_estimate.hpp"

namespace parhelion::people {
namespace {

constexpr double kReturned = 0.5;  // what the votes of a track that was no person meanwhile count

/// Sums of a fast covariance intersection: weights are inverse to the traces of the positions' covariances.
class Intersection {
 public:
  void add(const Mover& mover) {
    const double weight = 1 / std::max(mover.covariance.topLeftCorner<2, 2>().trace(), 1e-6);
    Eigen::Matrix4d covariance = mover.covariance;
    covariance.diagonal().array() += 1e-9;
    const Eigen::Matrix4d information = weight * covariance.inverse();
    Eigen::Vector4d state;
    state << mover.position, mover.velocity;
    weights_ += weight;
    information_ += information;
    vector_ += information * state;
  }
  void put(FusedPerson& person) const {
    const Eigen::Matrix4d covariance = (information_ / weights_).inverse();
    const Eigen::Vector4d state = covariance * (vector_ / weights_);
    person.position = state.head<2>();
    person.velocity = state.tail<2>();
    person.covariance = (covariance + covariance.transpose()) / 2;
  }

 private:
  double weights_ = 0;
  Eigen::Matrix4d information_ = Eigen::Matrix4d::Zero();
  Eigen::Vector4d vector_ = Eigen::Vector4d::Zero();
};

}  // namespace

void FusedPeople::set(std::size_t sensor, std::span<const Mover> movers, SimulationTime now) {
  replace(sensor, movers, now);
  for (FusedPerson& person : persons_) {
    if (now - person.seen > seconds(kVelocityLife)) person.velocity.setZero();
    predict(person, now);
  }
  observe_bonds(now);
  gather();
  identify(now);
  vote();
  estimate(now);
}

/// Tracks that go on keep their votes; one that was no person for a while gets them back in part.
void FusedPeople::replace(std::size_t sensor, std::span<const Mover> movers, SimulationTime now) {
  const auto ended = [&](const Sighting& s) {
    return s.key.first == sensor && std::none_of(movers.begin(), movers.end(), [&](const Mover& mover) {
             return mover.id == s.key.second && mover.kind == MoverClass::person;
           });
  };
  std::copy_if(sightings_.begin(), sightings_.end(), std::back_inserter(ended_), ended);
  std::erase_if(sightings_, ended);
  std::erase_if(ended_, [&](const Sighting& s) { return now - s.mover.seen > options_.remembered; });
  for (const Mover& mover : movers) {
    if (mover.kind != MoverClass::person) continue;
    const Key key(sensor, mover.id);
    auto place = find(key);
    if (place == sightings_.end() || place->key != key)
      place = sightings_.insert(place, begin(key, mover, now));
    place->mover = mover;
  }
  for (Sighting& s : sightings_) {
    s.unseen = now - s.mover.seen > options_.stale ? std::max((now - s.here.stamp).seconds(), 0.0) : 0;
    s.fresh = now - s.mover.seen <= options_.stale;
    s.here = at(s.mover, now);
  }
}

FusedPeople::Sighting FusedPeople::begin(const Key& key, const Mover& mover, SimulationTime now) {
  Sighting sighting;
  sighting.key = key;
  sighting.voted = mover.seen;
  sighting.began = sighting.here.stamp = now;
  const auto before =
      std::find_if(ended_.begin(), ended_.end(), [&](const Sighting& s) { return s.key == key; });
  if (before != ended_.end()) {
    sighting.votes = before->votes;
    for (Vote& vote : sighting.votes) vote.weight *= kReturned;
    ended_.erase(before);
  }
  return sighting;
}

/// The sighting that most certainly is of this person, or nullptr.
const FusedPeople::Sighting* FusedPeople::leader(const FusedPerson& person) const {
  const Sighting* best = nullptr;
  const auto rank = [&](const Sighting& s) {
    return std::pair(s.fresh, votes_for(s, person.id) + continues(s, person));
  };
  for (const Sighting& s : sightings_)
    if (s.person == person.id && (best == nullptr || rank(s) > rank(*best))) best = &s;
  return best;
}

void FusedPeople::estimate(SimulationTime now) {
  shown_.clear();
  for (FusedPerson& person : persons_) {
    Intersection sum;
    person.sensors = 0;
    double radius = 0;
    const Sighting* first = leader(person);
    for (const Sighting& s : sightings_) {
      if (s.person != person.id || (first->fresh && !s.fresh) || !fit(*first, s)) continue;
      sum.add(s.here);
      ++person.sensors;
      radius = std::max(radius, s.mover.radius);
      person.seen = std::max(person.seen, s.mover.seen);
    }
    if (person.sensors == 0) continue;
    sum.put(person);
    person.radius = radius;
    person.stamp = now;
    shown_.push_back(person);
  }
  std::erase_if(persons_, [&](const FusedPerson& person) {
    return person.sensors == 0 && now - person.seen > options_.remembered;
  });
}

}  // namespace parhelion::people
