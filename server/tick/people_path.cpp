#include "server/tick/people_path.hpp"

#include <algorithm>

namespace parhelion::tick {
namespace {

constexpr Duration kPersonLife = seconds(1.0);
constexpr double kReach = 0.4;  // m from a person's place: legs and arms
constexpr double kSigmas = 2;   // of both robots' positions about another robot's outline

/// The other robots whose poses are known.
void find_other_robots(const TickContext& context, const RealRobots& real,
                       std::vector<people::KnownRobot>& others) {
  others.clear();
  const double own_sigma = real[context.robot_index] ? real[context.robot_index]->sigma : 0;
  for (std::size_t i = 0; i < real.size(); ++i) {
    if (i == context.robot_index || !real[i]) continue;
    double radius = 0;
    for (const Eigen::Vector2d& corner : context.configuration.robot_at(i).footprint)
      radius = std::max(radius, corner.norm());
    others.push_back({real[i]->T_map_base.translation().head<2>(),
                      radius + kSigmas * std::hypot(own_sigma, real[i]->sigma)});
  }
}

void hand_over(const PeoplePath& path) {
  std::vector<simulation::RealPerson>& persons = path.bystanders.persons;
  persons.clear();
  for (const people::FusedPerson& person : path.bystanders.fused.persons())
    persons.push_back({person.id, person.position, person.velocity, person.radius, person.stamp,
                       person.covariance.topLeftCorner<2, 2>(), person.seen});
  path.simulation.set_real_people(persons);
}

}  // namespace

void track_people(const TickContext& context, people::LaserSweep sweep, const RealRobots& real,
                  const PeoplePath& path) {
  if (context.configuration.scenario.level != 3) return;
  PeopleState& state = path.state;
  state.seen = context.now;
  find_other_robots(context, real, state.others);
  sweep.robots = state.others;
  const auto movers = state.tracker.update(sweep);
  state.follows = std::any_of(movers.begin(), movers.end(), [](const people::Mover& mover) {
    return mover.kind == people::MoverClass::person;
  });
  path.bystanders.fused.set(state.sensor, movers, context.now);
  hand_over(path);
}

bool near_person(const Bystanders& bystanders, const Eigen::Vector2d& place) {
  return std::any_of(
      bystanders.persons.begin(), bystanders.persons.end(),
      [&](const simulation::RealPerson& person) { return (person.position - place).norm() < kReach; });
}

void forget_old_people(const TickContext& context, const PeoplePath& path) {
  if (!path.state.follows || context.now - path.state.seen <= kPersonLife) return;
  path.state.follows = false;
  path.bystanders.fused.set(path.state.sensor, {}, context.now);
  hand_over(path);
}

}  // namespace parhelion::tick
