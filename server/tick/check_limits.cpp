#include "server/tick/check_limits.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>

#include "protocols/convex_hull.hpp"
#include "protocols/length_text.hpp"
#include "server/simulation/building/planar.hpp"

namespace parhelion::tick {
namespace {

using simulation::Footprint;

/// Where the robot may be; none: anywhere.
using Place = std::optional<Footprint>;

Place place_of(const Zone& zone) { return simulation::make_polygon(convex_hull(zone.outline)); }

/// m, at least, to fulfil the condition from `place`, which then is where it was fulfilled.
double shortest_path(const Condition& condition, const std::vector<Zone>& zones, Place& place) {
  if (condition.kind == Condition::Kind::then) {
    double sum = 0;
    for (const Condition& part : condition.parts) sum += shortest_path(part, zones, place);
    return sum;
  }
  const auto zone = std::find_if(zones.begin(), zones.end(),
                                 [&](const Zone& each) { return each.name == condition.target; });
  if (condition.kind != Condition::Kind::reach || zone == zones.end()) {
    place.reset();
    return 0;
  }
  const Place goal = place_of(*zone);
  const double path = place ? std::max(0.0, simulation::signed_distance(*place, *goal)) : 0;
  place = goal;
  return path;
}

}  // namespace

std::vector<ShortLimit> short_limits(const Configuration& configuration) {
  std::vector<ShortLimit> found;
  const Scenario& scenario = configuration.scenario;
  const double speed = configuration.robot.limits.speed;
  if (!scenario.training || !(speed > 0)) return found;
  Place start;
  if (simulates_trainee(scenario))
    start = simulation::make_disc(scenario.trainee->T_map_base.translation().head<2>(), 0);
  Place place = start;
  for (std::size_t i = 0; i < scenario.training->tasks.size(); ++i) {
    const Task& task = scenario.training->tasks[i];
    if (!scenario.training->in_order) place = start;
    const double path = shortest_path(task.done, scenario.zones, place);
    if (!task.limit || *task.limit * speed >= path) continue;
    char text[200];
    std::snprintf(text, sizeof text,
                  "limit of %.1f s cannot be met: the straight path of %s takes %.1f s at %.2f m/s",
                  *task.limit, length_text(path).c_str(), path / speed, speed);
    found.push_back({i, "task '" + task.name + "': its " + text});
  }
  return found;
}

}  // namespace parhelion::tick
