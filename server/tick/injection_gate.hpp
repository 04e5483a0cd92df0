// Decides whether an agent may be shown to the robot's sensors: not while its returns would be too uncertain.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocols/scenario.hpp"
#include "server/simulation/simulation.hpp"

namespace parhelion::tick {

/// An agent that exceeded the limit returns in two steps, so that it neither flickers nor appears where the
/// robot can no longer stop: once its error is clearly below the limit, the simulation keeps it outside the
/// stopping distance, and later measurements show it.
class InjectionGate {
 public:
  /// `robot`: the index of the robot whose sensors it is about.
  explicit InjectionGate(std::size_t robot = 0) : robot_(robot) {}

  /// `error`: m, the predicted error of a return from the agent (or from a drawn wall), the maximum over its
  /// bodies. `first`: the measurement's first instant, on the simulation's clock. Updates the simulation.
  bool admit(const std::string& agent, double error, SimulationTime first, const InjectionLimits& limits,
             simulation::Simulation& simulation);

  /// As the last measurement decided; true for an agent that none had in range.
  bool shows(const std::string& agent) const;

  /// A change of whether an agent is shown.
  struct Change {
    std::string agent;
    bool shown = false;
  };
  /// Changes since the last call, in order.
  std::vector<Change> take_changes() { return std::exchange(changes_, {}); }

 private:
  struct Hidden {
    std::string agent;
    std::optional<SimulationTime> returning;  ///< start of the return; none: withheld
  };
  std::size_t robot_;
  std::vector<Hidden> hidden_;
  std::vector<Change> changes_;
};

}  // namespace parhelion::tick
