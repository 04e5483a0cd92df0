// Whether an agent may be shown to the robot's sensors: not while a return from it would be too uncertain.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocols/scenario.hpp"
#include "server/simulation/simulation.hpp"

namespace parhelion::tick {

/// An agent that the limit has stopped comes back in two steps, so that it neither blinks nor appears where
/// the robot cannot stop any more: once its error is clearly below the limit the simulation keeps it out of
/// the stopping distance, and measurements from then on show it.
class InjectionGate {
 public:
  /// `error`: m, the predicted error of a return from the agent (or from a drawn wall), the worst of its
  /// bodies. `first`: the measurement's first instant, on the simulation's clock. The simulation is told.
  bool admit(const std::string& agent, double error, SimulationTime first, const InjectionLimits& limits,
             simulation::Simulation& simulation);

  /// Whether an agent is shown has changed.
  struct Change {
    std::string agent;
    bool shown = false;
  };
  /// Since this was asked last, in their order.
  std::vector<Change> take_changes() { return std::exchange(changes_, {}); }

 private:
  struct Hidden {
    std::string agent;
    std::optional<SimulationTime> returning;  ///< since when
  };
  std::vector<Hidden> hidden_;
  std::vector<Change> changes_;
};

}  // namespace parhelion::tick
