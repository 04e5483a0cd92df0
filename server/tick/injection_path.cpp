// What the robot's sensors show of what is virtual, as events: who grades must know what could be seen.
#include "server/tick/tick.hpp"

namespace parhelion::tick {
namespace {

constexpr Duration scan_silence = milliseconds(500);  // without a scan for longer, nothing virtual is sensed

void say_injection(const Configuration& configuration, SimulationTime now, const std::string& reason,
                   State& state, Outputs& outputs) {
  const bool live = reason.empty();
  if (live == state.scan.said_live) return;
  state.scan.said_live = live;
  Event event;
  event.stamp = now;
  event.kind = live ? EventKind::injection_restored : EventKind::injection_degraded;
  event.subject = configuration.robot.name;
  event.text = reason;
  publish_event(configuration, event, state, outputs);
}

void note_withheld(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs) {
  for (const InjectionGate::Change& change : state.gate.take_changes()) {
    Event event;
    event.stamp = now;
    event.kind = change.shown ? EventKind::agent_shown : EventKind::agent_withheld;
    event.subject = configuration.robot.name;
    event.object = change.agent;
    publish_event(configuration, event, state, outputs);
  }
}

}  // namespace

void note_injection(const Configuration& configuration, SimulationTime now, const std::string& reason,
                    State& state, Outputs& outputs) {
  state.scan.live = reason.empty();
  say_injection(configuration, now, reason, state, outputs);
}

bool injection_is_live(const State& state, SimulationTime now) {
  return state.scan.live && now - state.scan.last_scan < scan_silence;
}

void watch_injection(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs) {
  note_withheld(configuration, now, state, outputs);
  if (simulates_trainee(configuration.scenario) || now - state.scan.last_scan < scan_silence) return;
  const bool none_yet = state.tally.scans_in == 0;
  say_injection(configuration, now, none_yet ? "no scan yet" : "no scan for 0.5 s", state, outputs);
}

}  // namespace parhelion::tick
