#include "server/tick/door_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/simulation/simulation.hpp"

namespace parhelion::tick {
namespace {

constexpr Duration kDoorLife = seconds(1.0);  // older measurements expire: the door may have moved
constexpr double kStill = 0.01;               // rad: smaller changes are noise of the fit
constexpr double kLeap = 0.35;     // rad: a larger jump must appear in two scans, as people walk past
constexpr double kMaxError = 0.1;  // m: with a worse pose, doors are not measured

void observe(const TickContext& context, std::size_t sensor, TrackedDoor& tracked,
             const scan::LeafFitResult& fit, simulation::Simulation& simulation) {
  const SimulationTime now = context.now;
  if (tracked.newest.size() <= sensor) tracked.newest.resize(sensor + 1);
  const std::optional<double> before = std::exchange(tracked.newest[sensor], fit.angle);
  const auto is_near = [&](const std::optional<double>& angle) {
    return angle && std::abs(*angle - *fit.angle) < kLeap;
  };
  if (fit.angle && (is_near(tracked.angle) || is_near(before))) {
    tracked.seen = now;
    if (tracked.angle && std::abs(*tracked.angle - *fit.angle) < kStill) return;
    tracked.angle = fit.angle;
    simulation.observe_door(tracked.door.name, opening_of(tracked.hinge, *fit.angle));
    return;
  }
  const bool gone = fit.gone && !fit.angle;
  if (!tracked.angle || (!gone && now - tracked.seen < kDoorLife)) return;
  tracked.angle.reset();
  simulation.observe_door(tracked.door.name, std::nullopt);
}

}  // namespace

void find_real_doors(const Configuration& configuration, const SemanticModel& model,
                     simulation::Simulation& simulation, DoorTracker& tracker) {
  const std::vector<TrackedDoor> old = std::exchange(tracker.doors, {});
  if (simulates_trainee(configuration.scenario)) return;
  for (const simulation::DoorState& stands : simulation.doors()) {
    const auto door = std::find_if(model.entities.begin(), model.entities.end(),
                                   [&](const ModelEntity& entity) { return entity.name == stands.name; });
    if (stands.dynamic || door == model.entities.end()) continue;
    TrackedDoor& tracked =
        tracker.doors.emplace_back(TrackedDoor{*door, hinge_of(*door), {}, std::nullopt, {}, {}});
    tracked.walls = scan::walls_beside(*door, tracked.hinge, model);
    for (const TrackedDoor& before : old) {
      if (before.door.name != stands.name || !before.angle) continue;
      tracked.angle = before.angle;
      tracked.seen = before.seen;
      simulation.observe_door(stands.name, opening_of(tracked.hinge, *before.angle));
    }
  }
}

void update_door_angles(const TickContext& context, const PlacedScan& placed, DoorTracker& tracker,
                        simulation::Simulation& simulation) {
  if (tracker.doors.empty()) return;
  const bool usable = placed.sigma <= kMaxError;
  if (usable) {
    tracker.fit.set_scan(placed.real, placed.description, placed.laser, placed.beam_time, placed.sigma);
  }
  for (TrackedDoor& door : tracker.doors)
    observe(context, placed.sensor, door,
            usable ? tracker.fit.find(door.door, door.hinge, door.angle, door.walls) : scan::LeafFitResult{},
            simulation);
}

}  // namespace parhelion::tick
