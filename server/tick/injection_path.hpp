// Publishes events on whether the robot's sensors show virtual objects: the grader needs to know what was
// visible.
#pragma once

#include <optional>
#include <string>

#include "server/tick/injection_gate.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

struct InjectionState {
  InjectionGate gate;
  bool live = false;                  ///< the last scan was augmented
  std::optional<bool> reported_live;  ///< as in the newest event; none: no event yet
  SimulationTime last_scan;           ///< its arrival
};

/// After a scan: publishes an event for the first state and for each change between live and degraded
/// (`reason` not empty).
void report_injection(const TickContext& context, const std::string& reason, InjectionState& injection);
/// At each step: reports agents that the gate withheld or showed again, and a missing SCAN of a real robot.
void watch_injection(const TickContext& context, InjectionState& injection);
/// Whether the newest scan was augmented and is recent.
bool injection_is_live(const InjectionState& injection, SimulationTime now);

}  // namespace parhelion::tick
