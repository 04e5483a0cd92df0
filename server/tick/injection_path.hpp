// Publishes events on whether the robot's sensors show virtual objects: the grader needs to know what was
// visible.
#pragma once

#include <optional>
#include <string>

#include "server/tick/injection_gate.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// Whether the scans of one laser show virtual objects.
struct ScanInjection {
  std::string laser;                  ///< name of a laser after the first; empty: the first
  bool live = false;                  ///< the last scan was augmented
  std::optional<bool> reported_live;  ///< as in the newest event; none: no event yet
  SimulationTime last_scan;           ///< its arrival
};

/// Of a robot: by its first laser, and for all of its sensors.
struct InjectionState : ScanInjection {
  InjectionGate gate;
};

/// After a scan: publishes an event for the first state and for each change between live and degraded
/// (`reason` not empty). The object of the event is the laser's name.
void report_injection(const TickContext& context, const std::string& reason, ScanInjection& injection);
/// At each step: reports agents that the gate withheld or showed again.
void report_gate_changes(const TickContext& context, InjectionGate& gate);
/// At each step: reports that a real laser is silent.
void watch_injection(const TickContext& context, ScanInjection& injection);
/// Whether the newest scan was augmented and is recent.
bool injection_is_live(const ScanInjection& injection, SimulationTime now);

}  // namespace parhelion::tick
