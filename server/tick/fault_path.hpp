// Faults that are simulated on purpose with the trainee's simulated robot (the wire calls them lessons).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fusion/scan/ray_caster.hpp"
#include "protocols/instructor_command.hpp"
#include "protocols/lesson.hpp"
#include "protocols/scan.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

struct TimedFault {
  Lesson fault;
  bool active = false;  ///< as the newest event has it
};

struct FaultState {
  SimulationTime started;          ///< the session
  std::vector<TimedFault> faults;  ///< the scenario's, then those begun by command
};

/// At each step: a fault that begins or ends is an event; dead wheels stop turning.
void update_faults(const TickContext& context, FaultState& faults, simulation::Simulation& simulation);
/// The instructor begins a fault, or ends one. Error: an unknown kind, an amount out of range, one that only
/// simulated robots can have.
Status process_fault_command(const TickContext& context, const FaultCommand& command, FaultState& faults);
/// Laser dropout: beams of the trainee's simulated laser that get no return, and hit no body. `sequence`: of
/// the scan before.
void drop_beams(const Configuration& configuration, const FaultState& faults, std::uint64_t sequence,
                Scan& scan, std::span<scan::RangeHit> body_hits);

}  // namespace parhelion::tick
