#include "server/tick/injection_path.hpp"

#include <cstdio>

namespace parhelion::tick {
namespace {

/// Without a scan for longer, injection is suspended.
constexpr Duration kScanSilence = milliseconds(500);

void publish_injection_event(const TickContext& context, const std::string& reason,
                             ScanInjection& injection) {
  const bool live = reason.empty();
  if (live == injection.reported_live) return;
  injection.reported_live = live;
  Event event;
  event.stamp = context.now;
  event.kind = live ? EventKind::injection_active : EventKind::injection_suspended;
  event.subject = context.robot().name;
  event.object = injection.laser;
  event.text = reason;
  publish_event(context, event);
}

}  // namespace

void report_gate_changes(const TickContext& context, InjectionGate& gate) {
  for (const InjectionGate::Change& change : gate.take_changes()) {
    Event event;
    event.stamp = context.now;
    event.kind = change.shown ? EventKind::agent_shown : EventKind::agent_hidden;
    event.subject = context.robot().name;
    event.object = change.agent;
    publish_event(context, event);
  }
}

void report_injection(const TickContext& context, const std::string& reason, ScanInjection& injection) {
  injection.live = reason.empty();
  publish_injection_event(context, reason, injection);
}

bool injection_is_live(const ScanInjection& injection, SimulationTime now) {
  return injection.live && now - injection.last_scan < kScanSilence;
}

void watch_injection(const TickContext& context, ScanInjection& injection) {
  if (simulates_trainee(context.configuration.scenario) || context.now - injection.last_scan < kScanSilence)
    return;
  const bool none_yet = injection.last_scan == SimulationTime{};
  char silent[32];
  std::snprintf(silent, sizeof silent, "no scan for %g s", kScanSilence.seconds());
  publish_injection_event(context, none_yet ? "no scan yet" : silent, injection);
}

}  // namespace parhelion::tick
