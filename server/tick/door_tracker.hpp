// SCAN to the angles of real doors: virtual things meet them as they stand.
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
  std::optional<double> angle;   ///< rad, of the hinge, as it was last seen
  SimulationTime seen;           ///< arrival of that scan
  std::optional<double> newest;  ///< rad, by the newest scan, where that alone shows it
};

struct DoorTracker {
  std::vector<TrackedDoor> doors;  ///< that the simulation does not move, in its order
  scan::LeafFit fit;
};

/// Tracks the real doors of a model, which is the simulation's now; what scans have shown of one of a name
/// before stays. None where the trainee's robot is simulated, and with it its world.
void find_real_doors(const Configuration& configuration, const SemanticModel& model,
                     simulation::Simulation& simulation, DoorTracker& tracker);

/// A scan, where the laser was, and how well that is known.
struct PlacedScan {
  const Scan& real;
  const std::vector<float>& beam_time;  ///< as in scan::BeamSet
  const scan::LaserMotion& laser;
  double sigma = 0;  ///< m, 1 sigma of where a return lies in the map
};

/// `context.now` is the scan's arrival.
void update_door_angles(const TickContext& context, const PlacedScan& placed, DoorTracker& tracker,
                        simulation::Simulation& simulation);

}  // namespace parhelion::tick
