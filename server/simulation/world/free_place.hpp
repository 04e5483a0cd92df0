// Finds free poses for agents.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "server/simulation/bodies/agents.hpp"
#include "server/simulation/bodies/real_robot.hpp"
#include "server/simulation/world/environment.hpp"

namespace parhelion::simulation {

constexpr double kMaxCoordinate = 1e5;  // m from the map's origin

/// An error text if the position is too far from everything modelled; else empty.
std::string off_site(const Building& building, const Eigen::Vector2d& p);

/// Searches a free pose for one agent.
class PlaceSearch {
 public:
  /// `except`: this agent is not an obstacle; `zone`: area that the agent must avoid (append_stop_zone).
  PlaceSearch(AgentForm form, const Agent* except, std::vector<Footprint> zone,
              const Environment& environment, const Agents& agents)
      : form_(std::move(form)),
        except_(except),
        zone_(std::move(zone)),
        environment_(environment),
        agents_(agents) {}

  /// Name of the obstacle at the pose; empty: the pose is free.
  std::string obstruction(const Pose2& pose);
  /// Within 6 m, and not behind a wall: in a straight line from the pose or connected with it by free floor
  /// within that distance. From a pose inside an obstacle only in a straight line, to either side.
  std::optional<Pose2> nearest_free(const Pose2& pose);

 private:
  /// Obstacles of the building that a small disc at p touches.
  const std::vector<const FixedObstacle*>& touched_at(const Eigen::Vector2d& p, double floor);
  bool in_straight_line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double floor);
  void flood(const Eigen::Vector2d& from, double floor);
  bool reachable(const Eigen::Vector2d& from, const Eigen::Vector2d& to);

  AgentForm form_;
  const Agent* except_;
  std::vector<Footprint> zone_;
  const Environment& environment_;
  const Agents& agents_;
  std::vector<const FixedObstacle*> near_;
  std::vector<char> connected_;  ///< by flood(), row by row; empty: not yet computed
};

/// Checks the agent's T_map_base; the error for an occupied pose gives the nearest free one. `now`: the state
/// of each real robot, none if unknown.
Status check_place(const AgentDefinition& agent, const AgentForm& form, const Agent* except,
                   const Environment& environment, const Agents& agents, const RealRobots& real_robots,
                   std::span<const std::optional<RealRobotState>> now);

}  // namespace parhelion::simulation
