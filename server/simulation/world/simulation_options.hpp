// What a simulation is created with, besides the building and the robots.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "protocols/hazard.hpp"
#include "protocols/model_objects.hpp"
#include "protocols/scenario.hpp"
#include "protocols/scene.hpp"
#include "protocols/time.hpp"
#include "protocols/zone.hpp"
#include "server/simulation/robots/robot_model.hpp"

namespace parhelion::simulation {

struct SimulationOptions {
  double rate = 240;  ///< Hz
  Duration history = seconds(2.0);
  std::uint64_t seed = 1;
  std::size_t max_agents = 1000;
  BodyId building_bodies = 0;  ///< ids reserved for the bodies of later buildings (set_building)
  /// The library of articulated robots: AgentDefinition::model names one of them.
  std::vector<std::shared_ptr<const RobotModel>> robot_models;
  /// The reference implementation: agents without possible contacts go through the solver like the others.
  /// Equal up to rounding.
  bool solve_all = false;
  std::vector<Zone> zones;  ///< entering and leaving them are events
  std::vector<Hazard> hazards;
  std::optional<Radio> radio;      ///< none: simulated robots always have radio contact
  std::optional<Battery> battery;  ///< none: never empty
  int level = 3;  ///< at levels 1 and 2 physics moves all doors, at level 3 only virtual ones
  /// Movable objects of the site, as take_movable() returns them: free bodies with their own names, there
  /// from the start and at rest until touched.
  std::vector<ModelObject> objects;
  std::vector<DoorSettings> doors;  ///< for some of the building's doors; other names are ignored
};

}  // namespace parhelion::simulation
