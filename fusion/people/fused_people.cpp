#include "fusion/people/fused_people.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <tuple>

namespace parhelion::people {
namespace {

constexpr double kAcceleration = 0.8;  // m^2/s^3, spectral density, as of a track
constexpr double kLongest = 0.5;       // s for which a velocity is believed

/// Moves an estimate to `now` with constant velocity.
template <class Estimate>
void predict(Estimate& estimate, SimulationTime now) {
  const double dt = std::max((now - estimate.stamp).seconds(), 0.0);
  const double moving = std::min(dt, kLongest);
  estimate.position += moving * estimate.velocity;
  Eigen::Matrix4d F = Eigen::Matrix4d::Identity();
  F(0, 2) = F(1, 3) = moving;
  estimate.covariance = F * estimate.covariance * F.transpose();
  for (const int i : {0, 1}) {
    estimate.covariance(i, i) += kAcceleration * dt * dt * dt / 3;
    estimate.covariance(i + 2, i + 2) += kAcceleration * dt;
  }
  estimate.stamp = std::max(estimate.stamp, now);
}

template <class Estimate>
Estimate at(Estimate estimate, SimulationTime now) {
  predict(estimate, now);
  return estimate;
}

/// Squared Mahalanobis distance of two positions; `sigma`: m, of each beside the covariances.
template <class A, class B>
double distance2(const A& a, const B& b, double sigma) {
  Eigen::Matrix2d S =
      a.covariance.template topLeftCorner<2, 2>() + b.covariance.template topLeftCorner<2, 2>();
  S.diagonal().array() += 2 * sigma * sigma;
  const Eigen::Vector2d gap = a.position - b.position;
  return gap.dot(S.inverse() * gap);
}

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
  replace(sensor, movers);
  for (FusedPerson& person : persons_) {
    if (now - person.seen > seconds(kLongest)) person.velocity.setZero();
    predict(person, now);
  }
  split(now);
  link(now);
  merge(now);
  estimate(now);
}

/// Tracks that go on keep their person.
void FusedPeople::replace(std::size_t sensor, std::span<const Mover> movers) {
  const auto key = [](const Sighting& s) { return std::pair(s.sensor, s.mover.id); };
  std::erase_if(sightings_, [&](const Sighting& s) {
    return s.sensor == sensor && std::none_of(movers.begin(), movers.end(), [&](const Mover& mover) {
             return mover.id == s.mover.id && mover.kind == MoverClass::person;
           });
  });
  for (const Mover& mover : movers) {
    if (mover.kind != MoverClass::person) continue;
    const auto place = std::lower_bound(
        sightings_.begin(), sightings_.end(), std::pair(sensor, mover.id),
        [&](const Sighting& s, const std::pair<std::size_t, std::uint32_t>& k) { return key(s) < k; });
    if (place != sightings_.end() && key(*place) == std::pair(sensor, mover.id)) {
      place->mover = mover;
    } else {
      sightings_.insert(place, Sighting{sensor, mover, 0, {}, {}});
    }
  }
}

/// Whether two sightings may be of one person.
bool FusedPeople::fit(const Sighting& a, const Sighting& b, SimulationTime now) const {
  const Mover one = at(a.mover, now), other = at(b.mover, now);
  const double gap = (one.position - other.position).norm();
  if (a.sensor == b.sensor) return gap < options_.body || !fresh(a, now) || !fresh(b, now);
  return gap < options_.max_gap && distance2(one, other, options_.pose_sigma) < options_.gate;
}

/// A sighting that has been away from the others of its person for a while is of somebody else.
void FusedPeople::split(SimulationTime now) {
  for (Sighting& own : sightings_) {
    if (own.person == 0) continue;
    bool alone = true, fits = false;
    for (const Sighting& other : sightings_) {
      const bool older = std::tuple(other.linked, other.sensor, other.mover.id) <
                         std::tuple(own.linked, own.sensor, own.mover.id);
      if (other.person != own.person || !older) continue;  // the newcomer leaves
      alone = false;
      fits = fits || fit(own, other, now);
    }
    if (alone || fits) own.fits = now;
    if (now - own.fits > options_.confirm) own.person = 0;
  }
}

bool FusedPeople::seen_by(std::uint32_t person, std::size_t sensor) const {
  return std::any_of(sightings_.begin(), sightings_.end(),
                     [&](const Sighting& s) { return s.person == person && s.sensor == sensor; });
}

/// Of a person whom its sensor sees elsewhere a sighting is not.
bool FusedPeople::may_be(const Sighting& sighting, std::uint32_t person, SimulationTime now) const {
  return std::all_of(sightings_.begin(), sightings_.end(), [&](const Sighting& other) {
    return other.person != person || other.sensor != sighting.sensor || fit(sighting, other, now);
  });
}

/// New sightings: the nearest persons whom they may be, or else new ones.
void FusedPeople::link(SimulationTime now) {
  pairings_.clear();
  for (std::size_t i = 0; i < sightings_.size(); ++i) {
    if (sightings_[i].person != 0) continue;
    const Mover here = at(sightings_[i].mover, now);
    for (std::size_t p = 0; p < persons_.size(); ++p) {
      const FusedPerson& person = persons_[p];
      if (!may_be(sightings_[i], person.id, now)) continue;
      const double unseen = std::min((now - person.seen).seconds(), options_.remembered.seconds());
      if ((here.position - person.position).norm() > options_.max_gap + options_.wander * unseen) continue;
      const double cost = distance2(here, person, options_.pose_sigma);
      if (cost < options_.gate) pairings_.push_back({cost, i, p});
    }
  }
  std::sort(pairings_.begin(), pairings_.end());
  for (const Pairing& each : pairings_) {
    Sighting& sighting = sightings_[each.sighting];
    if (sighting.person != 0 || !may_be(sighting, persons_[each.person].id, now)) continue;
    sighting.person = persons_[each.person].id;
    sighting.linked = sighting.fits = now;
  }
  for (Sighting& sighting : sightings_) {
    if (sighting.person != 0) continue;
    FusedPerson person;
    person.id = sighting.person = ++last_id_;
    person.stamp = now;
    sighting.linked = sighting.fits = now;
    persons_.push_back(person);
  }
}

bool FusedPeople::seen_by_same_sensor(std::uint32_t a, std::uint32_t b) const {
  return std::any_of(sightings_.begin(), sightings_.end(),
                     [&](const Sighting& s) { return s.person == a && seen_by(b, s.sensor); });
}

/// Two persons seen by different sensors that stay close to each other are one: the older keeps the identity.
void FusedPeople::merge(SimulationTime now) {
  estimate(now);
  std::erase_if(close_since_, [&](const auto& each) {
    const auto is_shown = [&](std::uint32_t id) {
      return std::any_of(shown_.begin(), shown_.end(), [id](const FusedPerson& p) { return p.id == id; });
    };
    return !is_shown(each.first.first) || !is_shown(each.first.second);
  });
  for (std::size_t i = 0; i < shown_.size(); ++i) {
    for (std::size_t j = i + 1; j < shown_.size(); ++j) {
      const FusedPerson &a = shown_[i], &b = shown_[j];
      const bool close = (a.position - b.position).norm() < options_.max_gap &&
                         (a.velocity - b.velocity).norm() < options_.max_speed_gap &&
                         distance2(a, b, options_.pose_sigma) < options_.gate &&
                         !seen_by_same_sensor(a.id, b.id);
      const std::pair pair(a.id, b.id);
      if (!close) {
        close_since_.erase(pair);
        continue;
      }
      const auto since = close_since_.try_emplace(pair, now).first;
      if (now - since->second < options_.confirm) continue;
      for (Sighting& s : sightings_) {
        if (s.person != b.id) continue;
        s.person = a.id;
        s.linked = s.fits = now;
      }
      std::erase_if(persons_, [&](const FusedPerson& p) { return p.id == b.id; });
      close_since_.erase(pair);
      return estimate(now);  // others at the next call
    }
  }
}

void FusedPeople::estimate(SimulationTime now) {
  shown_.clear();
  for (FusedPerson& person : persons_) {
    Intersection sum;
    person.sensors = 0;
    double radius = 0;
    const bool any_fresh = std::any_of(sightings_.begin(), sightings_.end(), [&](const Sighting& s) {
      return s.person == person.id && fresh(s, now);
    });
    for (const Sighting& s : sightings_) {
      if (s.person != person.id || (any_fresh && !fresh(s, now))) continue;
      sum.add(at(s.mover, now));
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
