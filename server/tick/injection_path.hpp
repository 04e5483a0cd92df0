// Whether the robot's sensors show what is virtual, as events: who grades must know what could be seen.
#pragma once

#include <optional>
#include <string>

#include "server/tick/injection_gate.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

struct InjectionState {
  InjectionGate gate;
  bool live = false;                  ///< the last scan was answered with the truth
  std::optional<bool> reported_live;  ///< as the newest event has it; none: there was none
  SimulationTime last_scan;           ///< its arrival
};

/// After a scan. A change between live and degraded (`reason` not empty) is an event, and so is the first
/// state.
void report_injection(const TickContext& context, const std::string& reason, InjectionState& injection);
/// At each step: what the gate has withheld or shown again, and a real robot's SCAN that has not come for a
/// while, or not yet.
void watch_injection(const TickContext& context, InjectionState& injection);
/// Whether the newest scan was answered with the truth, and not long ago.
bool injection_is_live(const InjectionState& injection, SimulationTime now);

}  // namespace parhelion::tick
