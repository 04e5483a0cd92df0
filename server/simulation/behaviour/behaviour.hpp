// Decisions of agents: each agent twenty times a second, one after another. Implemented in behaviour.cpp
// (choice of behaviour, obstacles) and goals.cpp (behaviours with a goal position).
#pragma once

#include <optional>
#include <vector>

#include "server/simulation/behaviour/navigation.hpp"
#include "server/simulation/world/surroundings.hpp"

namespace parhelion::simulation {

class Behaviours {
 public:
  /// The motion requested by the agent's behaviour at this step. `agent`: one of around.agents. Appends
  /// events of goals reached.
  Twist2 wanted(Agent& agent, const Surroundings& around, std::vector<Event>& events);
  /// Before the decisions of a step: continues route searches. `agents`: those of `around`.
  void search_routes(Agents& agents, const Surroundings& around, std::vector<Event>& events) {
    navigation_.search_routes(agents, around, events);
  }
  /// Discards the agent's route.
  void forget_route(Agent& agent) { navigation_.forget_route(agent); }
  /// Reserves memory, so that no step allocates any.
  void reserve(std::size_t movers, std::size_t obstacles);

 private:
  Twist2 decide(Agent& agent, const Surroundings& around, std::vector<Event>& events);
  void gather_obstacles(const Agent& agent, const Surroundings& around);

  // goals.cpp
  struct Target {
    Pose2 pose;
    Twist2 twist;  ///< body frame
    const Footprint* placed;
    bool is_trainee;          ///< real or simulated; agents must not surprise it
    const RealRobot* brakes;  ///< assumed to brake like this robot
  };
  static std::optional<Target> target_of(const Behaviour& behaviour, const Surroundings& around);
  /// Computes where an agent that acts on the trainee's robot must not go.
  void update_exclusion_zone(const Target& target);
  Twist2 go(Agent& agent, const Surroundings& around, std::vector<Event>& events);
  Twist2 follow(Agent& agent, const Surroundings& around);
  Twist2 flee(Agent& agent, const Surroundings& around);
  std::optional<double> heading_away(const Agent& agent, const Target& target, const Surroundings& around);
  Twist2 block(Agent& agent, const Surroundings& around);
  std::optional<Eigen::Vector2d> blocking_place(Agent& agent, const Target& target,
                                                const Surroundings& around);
  std::optional<Twist2> step_aside(Agent& agent, const Surroundings& around);

  Navigation navigation_;
  // Reused memory.
  std::vector<const FixedObstacle*> near_;
  std::vector<std::uint32_t> nearby_;
};

}  // namespace parhelion::simulation
