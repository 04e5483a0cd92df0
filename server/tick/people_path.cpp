#include "server/tick/people_path.hpp"

#include <algorithm>

namespace parhelion::tick {
namespace {

constexpr Duration kPersonLife = seconds(1.0);
constexpr double kReach = 0.4;  // m from a person's place: legs and arms

}  // namespace

void track_people(const TickContext& context, const people::LaserSweep& sweep, PeopleState& state,
                  simulation::Simulation& simulation) {
  if (context.configuration.scenario.level != 3) return;
  state.seen = context.now;
  state.persons.clear();
  for (const people::Mover& mover : state.tracker.update(sweep)) {
    if (mover.kind != people::MoverClass::person) continue;
    state.persons.push_back({mover.id, mover.position, mover.velocity, mover.radius, mover.stamp, 0});
  }
  simulation.set_real_people(state.persons, context.robot_index);
}

bool near_person(const PeopleState& state, const Eigen::Vector2d& place) {
  return std::any_of(state.persons.begin(), state.persons.end(), [&](const simulation::RealPerson& person) {
    return (person.position - place).norm() < kReach;
  });
}

void forget_old_people(const TickContext& context, PeopleState& state, simulation::Simulation& simulation) {
  if (state.persons.empty() || context.now - state.seen <= kPersonLife) return;
  state.persons.clear();
  simulation.set_real_people(state.persons, context.robot_index);
}

}  // namespace parhelion::tick
