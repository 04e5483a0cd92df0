// Simulated faults of the trainee's simulated robot.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fusion/scan/ray_caster.hpp"
#include "protocols/fault.hpp"
#include "protocols/instructor_command.hpp"
#include "protocols/scan.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

struct TimedFault {
  Fault fault;
  bool active = false;  ///< as in the newest event
};

struct FaultState {
  SimulationTime started;          ///< start of the session
  std::vector<TimedFault> faults;  ///< the scenario's, then those started by command
};

/// At each step: publishes an event when a fault begins or ends, and stops dead wheels.
void update_faults(const TickContext& context, FaultState& faults, simulation::Simulation& simulation);
/// Starts or ends a fault on the instructor's command. Error: an unknown kind, an amount out of range, or a
/// fault that only simulated robots can have.
Status process_fault_command(const TickContext& context, const FaultCommand& command, FaultState& faults);
/// Laser dropout: removes returns of the trainee's simulated laser, and their body hits. `sequence`: of the
/// previous scan, see record_number().
void drop_beams(const Configuration& configuration, const FaultState& faults, const LaserDescription& laser,
                std::uint64_t sequence, Scan& scan, std::span<scan::RangeHit> body_hits);

}  // namespace parhelion::tick
