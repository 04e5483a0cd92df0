// Leads agents to a goal: by routes through the building, followed straight or by steering, with a new route
// where they make no progress.
#pragma once

#include <optional>
#include <vector>

#include "server/simulation/bodies/steering.hpp"
#include "server/simulation/building/route_search.hpp"
#include "server/simulation/building/router.hpp"
#include "server/simulation/world/surroundings.hpp"

namespace parhelion::simulation {

/// m of clearance for its route: its radius plus a margin.
double room_of(const Agent& agent);
/// Whether the agent opens the leaf by walking on.
bool walks_through(const Agent& agent, const FixedObstacle& leaf, const Environment& environment);

class Navigation {
 public:
  /// Motion towards the goal; zero while no route is known. `agent`: one of around.agents.
  Twist2 approach(Agent& agent, const Eigen::Vector2d& goal, const Surroundings& around);
  /// Continues searches and assigns finished routes to `agents`, those of `around`. Appends events of
  /// unreachable goals.
  void search_routes(Agents& agents, const Surroundings& around, std::vector<Event>& events);
  void forget_route(Agent& agent);
  /// The grid of the agent's floor.
  RouteGrid& grid_of(const Agent& agent, const Environment& environment);

  SteeringScratch steering;               ///< with the obstacles around the deciding agent
  std::vector<Footprint> exclusion_zone;  ///< area that this agent must avoid

 private:
  RouteQuery query_to(const Agent& agent, const Eigen::Vector2d& goal, bool round_agents,
                      const Surroundings& around);
  /// Whether the straight line is free of the building and closed doors.
  bool is_straight_free(const Agent& agent, const Eigen::Vector2d& p, const Environment& environment);
  void request_route(Agent& agent, const Eigen::Vector2d& goal, bool round_agents,
                     const Surroundings& around);
  std::optional<Eigen::Vector2d> lookahead_point(Agent& agent, const Eigen::Vector2d& goal,
                                                 const Surroundings& around);
  std::optional<Twist2> straight_to(const Agent& agent, const Eigen::Vector2d& point);
  Twist2 drive_to(Agent& agent, const Eigen::Vector2d& point, const Eigen::Vector2d& goal,
                  const Surroundings& around);
  std::string why_unreachable(const Router::Answer& answer, const Environment& environment);

  Router router_;
  std::vector<Router::Answer> answers_;  // reused memory
};

}  // namespace parhelion::simulation
