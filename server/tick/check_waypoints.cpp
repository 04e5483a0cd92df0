#include "server/tick/check_waypoints.hpp"

#include <algorithm>

#include "server/simulation/building/building.hpp"
#include "server/simulation/building/route_grid.hpp"
#include "server/simulation/world/place_text.hpp"

namespace parhelion::tick {
namespace {

constexpr double kHeight = 0.5;  // m over the floor: range of obstacles for any agent

/// Agents climb these, or open them.
bool can_be_entered(EntityLabel label) {
  return is_ground(label) || label == EntityLabel::stairs || label == EntityLabel::door;
}

/// In which part p is; empty: in none.
std::string obstruction(const simulation::Building& building, const Eigen::Vector2d& p) {
  const double floor = building.floor_height(p);
  std::vector<const simulation::FixedObstacle*> near;
  building.near(p, 0, floor + simulation::RouteGrid::kOverFloor, floor + kHeight, near);
  const simulation::Footprint point = simulation::make_disc(p, 0);
  for (const simulation::FixedObstacle* each : near) {
    if (!can_be_entered(each->label) && simulation::signed_distance(each->footprint, point) < 0)
      return simulation::place_text(p) + " is in '" + each->name + "' of the building";
  }
  return "";
}

}  // namespace

Result<std::vector<WrongWaypoint>> wrong_waypoints(const Configuration& configuration) {
  std::vector<WrongWaypoint> found;
  const std::vector<AgentDefinition>& agents = configuration.scenario.agents;
  if (configuration.model.entities.empty()) return found;
  const auto building = simulation::Building::create(configuration.model);
  if (!building) return building.error();
  for (std::size_t i = 0; i < agents.size(); ++i) {
    const std::vector<Eigen::Vector2d>& waypoints = agents[i].behaviour.waypoints;
    for (std::size_t k = 0; k < waypoints.size(); ++k) {
      const std::string what = obstruction(**building, waypoints[k]);
      if (what.empty()) continue;
      found.push_back(
          {i, k, "agent '" + agents[i].name + "': waypoint " + std::to_string(k + 1) + ": " + what});
    }
  }
  return found;
}

}  // namespace parhelion::tick
