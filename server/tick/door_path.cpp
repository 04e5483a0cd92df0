// SCAN to the angles of real doors: virtual things meet them as they stand.
#include <algorithm>
#include <cmath>
#include <utility>

#include "server/tick/door_sight.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::tick {
namespace {

constexpr Duration door_life = seconds(1.0);  // unseen for longer, it may have been turned
constexpr double still = 0.01;                // rad: less is the noise of the fit, and no leaf that turns
constexpr double leap = 0.35;       // rad: what leaps farther must be seen by two scans, as people walk past
constexpr double most_error = 0.1;  // m: a pose known worse says nothing of doors

void observe(SightedDoor& sighted, const scan::LeafSight& sight, SimulationTime now,
             simulation::Simulation& simulation) {
  const std::optional<double> before = std::exchange(sighted.fresh, sight.angle);
  const auto is_near = [&](const std::optional<double>& angle) {
    return angle && std::abs(*angle - *sight.angle) < leap;
  };
  if (sight.angle && (is_near(sighted.angle) || is_near(before))) {
    sighted.seen = now;
    if (sighted.angle && std::abs(*sighted.angle - *sight.angle) < still) return;
    sighted.angle = sight.angle;
    simulation.observe_door(sighted.door.name, opening_of(sighted.hinge, *sight.angle));
    return;
  }
  const bool gone = sight.gone && !sight.angle;
  if (!sighted.angle || (!gone && now - sighted.seen < door_life)) return;
  sighted.angle.reset();
  simulation.observe_door(sighted.door.name, std::nullopt);
}

}  // namespace

void find_real_doors(const Configuration& configuration, const SemanticModel& model, State& state) {
  const auto old = std::exchange(state.doors, nullptr);
  if (simulates_trainee(configuration.scenario)) return;
  auto sights = std::make_unique<DoorSights>();
  for (const simulation::DoorState& stands : state.simulation.doors()) {
    const auto door = std::find_if(model.entities.begin(), model.entities.end(),
                                   [&](const ModelEntity& entity) { return entity.name == stands.name; });
    if (stands.dynamic || door == model.entities.end()) continue;
    SightedDoor& sighted =
        sights->doors.emplace_back(SightedDoor{*door, hinge_of(*door), {}, std::nullopt, {}, std::nullopt});
    sighted.walls = scan::walls_beside(*door, sighted.hinge, model);
    if (!old) continue;
    for (const SightedDoor& before : old->doors) {
      if (before.door.name != stands.name || !before.angle) continue;
      sighted.angle = before.angle;
      sighted.seen = before.seen;
      state.simulation.observe_door(stands.name, opening_of(sighted.hinge, *before.angle));
    }
  }
  if (!sights->doors.empty()) state.doors = std::move(sights);
}

void sight_doors(const Configuration& configuration, const scan::LaserMotion& laser, double sigma,
                 State& state) {
  if (!state.doors) return;
  DoorSights& sights = *state.doors;
  ScanPath& path = state.scan;
  const bool usable = sigma <= most_error;
  if (usable) sights.fit.set_scan(path.real, *configuration.robot.laser, laser, path.beam_time, sigma);
  for (SightedDoor& door : sights.doors)
    observe(door, usable ? sights.fit.find(door.door, door.hinge, door.angle, door.walls) : scan::LeafSight{},
            path.last_scan, state.simulation);
}

}  // namespace parhelion::tick
