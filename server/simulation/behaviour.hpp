// What agents decide to do: twenty times a second each, one after another. The parts of this class are
// behaviour.cpp (which behaviour, and the obstacles around) and goals.cpp (behaviours that want to be
// somewhere).
#pragma once

#include <optional>
#include <vector>

#include "server/simulation/navigation.hpp"
#include "server/simulation/surroundings.hpp"

namespace parhelion::simulation {

class Behaviours {
 public:
  /// The motion that the agent's behaviour asks for at this step. `agent`: one of around.agents. Appends
  /// events of goals reached.
  Twist2 wanted(Agent& agent, const Surroundings& around, std::vector<Event>& events);
  /// Before the decisions of a step: searches for routes go on. `agents`: those of `around`.
  void search_routes(Agents& agents, const Surroundings& around, std::vector<Event>& events) {
    navigation_.search_routes(agents, around, events);
  }
  /// What the agent was about to do is over.
  void forget_route(Agent& agent) { navigation_.forget_route(agent); }
  /// Memory for so many, so that no step allocates any.
  void reserve(std::size_t movers, std::size_t obstacles);

 private:
  Twist2 decide(Agent& agent, const Surroundings& around, std::vector<Event>& events);
  void gather_obstacles(const Agent& agent, const Surroundings& around);

  // goals.cpp
  struct Target {
    Pose2 pose;
    Twist2 twist;  ///< body frame
    const Footprint* placed;
    bool is_trainee;          ///< whom nobody may surprise, real or simulated
    const RealRobot* brakes;  ///< it is taken to brake like this one
  };
  static std::optional<Target> target_of(const Behaviour& behaviour, const Surroundings& around);
  /// Where an agent that acts on the trainee's robot must not go.
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
  // Memory that is used again.
  std::vector<const FixedObstacle*> near_;
  std::vector<std::uint32_t> nearby_;
};

}  // namespace parhelion::simulation
