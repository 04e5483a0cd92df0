// Real people: tracked from each scan after its answer is out, and handed to the simulation.
#pragma once

#include <vector>

#include "fusion/people/people_tracker.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

struct PeopleState {
  people::PeopleTracker tracker;
  std::vector<simulation::RealPerson> persons;
  SimulationTime seen;  ///< arrival of the scan that they are from
};

/// Real robots only: a simulated robot's scans show agents.
void track_people(const TickContext& context, const people::LaserSweep& sweep, PeopleState& state,
                  simulation::Simulation& simulation);

/// Whether a return there is explained by a tracked person; `place`: m, map.
bool near_person(const PeopleState& state, const Eigen::Vector2d& place);

/// At each step: nobody is known where no scan has arrived for a second.
void forget_old_people(const TickContext& context, PeopleState& state, simulation::Simulation& simulation);

}  // namespace parhelion::tick
