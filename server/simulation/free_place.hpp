// Where there is room for an agent.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "server/simulation/agents.hpp"
#include "server/simulation/environment.hpp"
#include "server/simulation/real_robot.hpp"

namespace parhelion::simulation {

constexpr double kMostPlace = 1e5;  // m from the map's origin

/// What is wrong with a place that is too far from all that is modelled; empty: nothing.
std::string off_site(const Building& building, const Eigen::Vector2d& p);

/// Looks for room for one agent.
class PlaceSearch {
 public:
  /// `except`: this agent is in nobody's way; `zone`: where the agent must not be (append_stop_zone).
  PlaceSearch(AgentForm form, const Agent* except, std::vector<Footprint> zone,
              const Environment& environment, const Agents& agents)
      : form_(std::move(form)),
        except_(except),
        zone_(std::move(zone)),
        environment_(environment),
        agents_(agents) {}

  /// What is in the way there; empty: the place is free.
  std::string obstruction(const Pose2& pose);
  /// Within 6 m.
  std::optional<Pose2> nearest_free(const Pose2& pose);

 private:
  AgentForm form_;
  const Agent* except_;
  std::vector<Footprint> zone_;
  const Environment& environment_;
  const Agents& agents_;
  std::vector<const FixedObstacle*> near_;
};

/// Whether the agent may be at its T_map_base; an occupied place is answered with the nearest free one.
/// `now`: where each of the real robots is, none where nobody knows.
Status check_place(const AgentDefinition& agent, const AgentForm& form, const Agent* except,
                   const Environment& environment, const Agents& agents, const RealRobots& real_robots,
                   std::span<const std::optional<RealRobotState>> now);

}  // namespace parhelion::simulation
