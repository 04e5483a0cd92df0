// The real doors of level 3, as scans show them.
#pragma once

#include <optional>
#include <vector>

#include "fusion/scan/leaf_fit.hpp"
#include "protocols/time.hpp"

namespace parhelion::tick {

struct Configuration;
struct State;

struct SightedDoor {
  ModelEntity door;
  Hinge hinge;
  std::vector<scan::WallBeside> walls;
  std::optional<double> angle;  ///< rad, of the hinge, as it was last seen
  SimulationTime seen;          ///< arrival of that scan
  std::optional<double> fresh;  ///< rad, of the newest scan, where that alone says so
};

struct DoorSights {
  std::vector<SightedDoor> doors;  ///< that the simulation does not move, in its order
  scan::LeafFit fit;
};

/// Sets state.doors to the real doors of a model, which is the simulation's now; what scans have shown of one
/// of a name before stays. None where the trainee's robot is simulated, and with it its world.
void find_real_doors(const Configuration& configuration, const SemanticModel& model, State& state);

}  // namespace parhelion::tick
