// SCAN to the angles of real doors, so that virtual objects meet them at their current angle.
#pragma once

#include <optional>
#include <vector>

#include "fusion/scan/leaf_fit.hpp"
#include "protocols/model.hpp"
#include "protocols/scan.hpp"
#include "protocols/time.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::simulation {
class Simulation;
}
namespace parhelion::tick {

struct TrackedDoor {
  ModelEntity door;
  Hinge hinge;
  std::vector<scan::WallBeside> walls;
  std::optional<double> angle;  ///< rad, at the hinge, as last measured
  SimulationTime seen;          ///< arrival of that scan
  std::vector<std::optional<double>>
      newest;  ///< rad, by laser: from its newest scan, where that alone shows it
};

struct DoorTracker {
  std::vector<TrackedDoor> doors;  ///< those not moved by the simulation, in its order
  scan::LeafFit fit;
};

/// Tracks the real doors of a model, which the simulation now uses; measured angles of doors with the same
/// name are kept. None where the trainee's robot, and with it the world, is simulated.
void find_real_doors(const Configuration& configuration, const SemanticModel& model,
                     simulation::Simulation& simulation, DoorTracker& tracker);

/// A scan with the laser's pose and its uncertainty.
struct PlacedScan {
  std::size_t sensor = 0;  ///< number of the laser among all sensors
  const Scan& real;
  const LaserDescription& description;
  const std::vector<float>& beam_time;  ///< as in scan::BeamSet
  const scan::LaserMotion& laser;
  double sigma = 0;  ///< m, 1 sigma of a return's position in the map
};

/// `context.now` is the scan's arrival.
void update_door_angles(const TickContext& context, const PlacedScan& placed, DoorTracker& tracker,
                        simulation::Simulation& simulation);

}  // namespace parhelion::tick
