// How agents get to a goal: by routes through the building, along them straight or by steering, and another
// way where they make no progress.
#pragma once

#include <optional>
#include <vector>

#include "server/simulation/route_search.hpp"
#include "server/simulation/router.hpp"
#include "server/simulation/steering.hpp"
#include "server/simulation/surroundings.hpp"

namespace parhelion::simulation {

/// m that its route keeps clear: its radius and a little more.
double room_of(const Agent& agent);
/// Whether the agent opens that leaf by walking on.
bool walks_through(const Agent& agent, const FixedObstacle& leaf, const Environment& environment);

class Navigation {
 public:
  /// Towards the goal; nothing while no route is known. `agent`: one of around.agents.
  Twist2 approach(Agent& agent, const Eigen::Vector2d& goal, const Surroundings& around);
  /// Searches go on; routes that were found go to their agents, `agents` of `around`. Appends events of goals
  /// that are unreachable.
  void search_routes(Agents& agents, const Surroundings& around, std::vector<Event>& events);
  void forget_route(Agent& agent);
  /// Of the floor that the agent is on.
  RouteGrid& grid_of(const Agent& agent, const Environment& environment);

  SteeringScratch steering;               ///< with the obstacles around the agent that decides
  std::vector<Footprint> exclusion_zone;  ///< where that agent must not go

 private:
  RouteQuery query_to(const Agent& agent, const Eigen::Vector2d& goal, bool round_agents,
                      const Surroundings& around);
  /// Whether it can go there straight, past building and closed doors.
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
  std::vector<Router::Answer> answers_;  // memory that is used again
};

}  // namespace parhelion::simulation
