// Upright agents that cannot have a contact before their next decision are moved without the solver, by the
// same laws: their poses, measurements and events are those of the solver. An agent that may get a contact is
// back in the solver before that.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/simulation/world/surroundings.hpp"

namespace parhelion::simulation {

/// Takes the agent out of the solver, or puts it back with its current motion.
void set_unconstrained(Agent& agent, bool unconstrained, Physics& physics);
/// Puts all agents back into the solver.
void constrain_all(Agents& agents, Physics& physics);
/// Puts those back that may touch an object appearing there.
void constrain_near(const Footprint& placed, Agents& agents, Physics& physics);
/// One step of an agent outside the solver.
void move_unconstrained(Agent& agent, double dt);

/// Finds the agents without possible contacts.
class ContactForecast {
 public:
  /// No contact is possible before the agent's next decision.
  bool untouchable(const Agent& agent, const Surroundings& around);
  /// Reserves memory, so that no step allocates any.
  void reserve(std::size_t movers, std::size_t obstacles) {
    nearby_.reserve(4 * movers + 64);
    near_.reserve(4 * obstacles);
  }

 private:
  // Reused memory.
  std::vector<std::uint32_t> nearby_;
  std::vector<const FixedObstacle*> near_;
  Footprint disc_;
};

}  // namespace parhelion::simulation
