#include "server/simulation/real_people.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::simulation {
namespace {

constexpr double kMaxPrediction = 0.5;  // s
constexpr double kMargin = 0.2;         // m kept to a person
constexpr double kStandsStill = 0.05;   // m/s
constexpr double kLookAhead = 8;        // m: farther people do not matter

/// `later`: s after its stamp.
void put(const RealPerson& person, double later, PlacedPerson& placed) {
  placed.id = person.id;
  placed.robot = person.robot;
  placed.velocity = person.velocity;
  placed.disc.vertices[0] = person.position + later * person.velocity;
  placed.disc.radius = person.radius;
  placed.disc.update_bound();
}

TouchingPair touching_pair(const Agent& agent, const PlacedPerson& person) {
  TouchingPair pair;
  pair.subject = agent.definition.name;
  const std::string robot = person.robot > 0 ? std::to_string(person.robot + 1) + "_" : "";
  pair.object = "person_" + robot + std::to_string(person.id);
  pair.pair = PairKind::real_virtual;
  pair.position << nearest_point(agent.placed, person.disc), agent.floor;
  pair.undetectable = agent.rigid.velocity.head<2>().norm() < kStandsStill;
  return pair;
}

}  // namespace

void RealPeople::set(const std::vector<RealPerson>& people, std::size_t robot) {
  std::erase_if(people_, [robot](const RealPerson& person) { return person.robot == robot; });
  for (const RealPerson& person : people) {
    people_.push_back(person);
    people_.back().robot = robot;
  }
  while (placed_.size() < people_.size()) placed_.push_back({0, 0, make_disc({0, 0}, 0), {0, 0}});
  for (std::size_t i = 0; i < people_.size(); ++i) put(people_[i], 0, placed_[i]);
}

void RealPeople::place(SimulationTime now) {
  for (std::size_t i = 0; i < people_.size(); ++i) {
    const RealPerson& person = people_[i];
    const double later = std::clamp((now - person.stamp).seconds(), 0.0, kMaxPrediction);
    put(person, later, placed_[i]);
  }
}

void RealPeople::report_contacts(const Agents& agents, SimulationTime now, std::vector<Event>& events) {
  touching_.clear();
  for (const PlacedPerson& person : placed()) {
    for (const Agent& agent : agents) {
      if (distance_bound(agent.placed, person.disc) <= 0 && signed_distance(agent.placed, person.disc) <= 0)
        touching_.push_back(touching_pair(agent, person));
    }
  }
  contacts_.update(touching_, now, events);
}

Twist2 slowed_for_people(const Agent& agent, const Twist2& wanted, const RealPeople& people) {
  const double speed = std::hypot(wanted.vx, wanted.vy);
  if (people.placed().empty() || speed < 1e-6) return wanted;
  const double c = std::cos(agent.pose.yaw), s = std::sin(agent.pose.yaw);
  const Eigen::Vector2d velocity(c * wanted.vx - s * wanted.vy, s * wanted.vx + c * wanted.vy);
  const double deceleration = limits_of(agent).acceleration;
  double scale = 1;
  for (const PlacedPerson& person : people.placed()) {
    const Eigen::Vector2d offset = person.disc.center - agent.pose.position();
    const double distance = offset.norm();
    const double closing = distance > 1e-6 ? velocity.dot(offset) / distance : speed;
    if (closing <= 0 || distance_bound(agent.placed, person.disc) > kLookAhead) continue;
    // Passing by: the person's disc is outside the strip that the agent drives over.
    const double aside = std::abs(velocity.x() * offset.y() - velocity.y() * offset.x()) / speed;
    if (aside > agent.placed.bound + person.disc.radius + kMargin) continue;
    const double gap = std::max(signed_distance(agent.placed, person.disc) - kMargin, 0.0);
    scale = std::min(scale, std::sqrt(2 * deceleration * gap) / closing);
  }
  return {scale * wanted.vx, scale * wanted.vy, scale * wanted.wz};
}

}  // namespace parhelion::simulation
