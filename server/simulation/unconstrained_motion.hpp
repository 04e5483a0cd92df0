// Upright agents that nothing can touch before they decide again are moved without the solver, by the same
// laws: where they are, what sensors measure and the events are what they would be with it. An agent that may
// be touched is back in the solver before that.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/simulation/surroundings.hpp"

namespace parhelion::simulation {

/// Out of the solver, or into it with the motion that the agent has now.
void set_unconstrained(Agent& agent, bool unconstrained, Physics& physics);
/// All agents back into the solver.
void constrain_all(Agents& agents, Physics& physics);
/// Those that may be touched by what appears there.
void constrain_near(const Footprint& placed, Agents& agents, Physics& physics);
/// One step of an unconstrained agent.
void move_unconstrained(Agent& agent, double dt);

/// Finds the agents that nothing can touch.
class ContactForecast {
 public:
  /// Nothing can touch the agent before it decides again.
  bool untouchable(const Agent& agent, const Surroundings& around);
  /// Memory for so many, so that no step allocates any.
  void reserve(std::size_t movers, std::size_t obstacles) {
    nearby_.reserve(4 * movers + 64);
    near_.reserve(4 * obstacles);
  }

 private:
  // Memory that is used again.
  std::vector<std::uint32_t> nearby_;
  std::vector<const FixedObstacle*> near_;
  Footprint disc_;
};

}  // namespace parhelion::simulation
