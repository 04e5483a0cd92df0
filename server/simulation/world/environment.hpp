// Surroundings of agents and robots at a step: the modelled building, its doors, and unmodelled real
// obstacles.
#pragma once

#include <memory>
#include <vector>

#include "server/simulation/bodies/real_people.hpp"
#include "server/simulation/building/building.hpp"
#include "server/simulation/building/planar.hpp"
#include "server/simulation/world/door_set.hpp"

namespace parhelion::simulation {

struct Environment {
  std::shared_ptr<Building> building;
  DoorSet doors;  ///< of the building
  /// Discs, m, map: real obstacles that the model does not explain, as each sensor sees them, and all of
  /// them.
  std::vector<std::vector<Footprint>> unmodelled_by_sensor;
  std::vector<Footprint> unmodelled;
  RealPeople people;
};

}  // namespace parhelion::simulation
