// Real people: tracked from the scans of each laser after their answers are out, and from depth images
// (depth_people.hpp), joined to persons, and handed to the simulation.
#pragma once

#include <vector>

#include "fusion/people/fused_people.hpp"
#include "fusion/people/people_tracker.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/pose_path.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// What one laser, or one slice through a depth camera's images, shows of people.
struct PeopleState {
  std::size_t sensor = 0;  ///< number among all of all robots
  people::PeopleTracker tracker;
  bool follows = false;                    ///< somebody, with the newest scans
  SimulationTime seen;                     ///< arrival of the newest scan
  std::vector<people::KnownRobot> others;  ///< scratch
};

/// The people around all robots.
struct Bystanders {
  people::FusedPeople fused;
  std::vector<simulation::RealPerson> persons;  ///< as the simulation has them
};

/// Dependencies of the people path of one sensor.
struct PeoplePath {
  PeopleState& state;
  Bystanders& bystanders;
  simulation::Simulation& simulation;
};

/// `sweep.robots` is filled in: where the other real robots are, nobody is a person. Real robots only: a
/// simulated robot's scans show agents.
void track_people(const TickContext& context, people::LaserSweep sweep, const RealRobots& real,
                  const PeoplePath& path);

/// Whether a return there is explained by a tracked person; `place`: m, map.
bool near_person(const Bystanders& bystanders, const Eigen::Vector2d& place);

/// At each step: a sensor without a scan for a second follows nobody.
void forget_old_people(const TickContext& context, const PeoplePath& path);

}  // namespace parhelion::tick
