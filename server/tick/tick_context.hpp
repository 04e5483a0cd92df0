// Common arguments of every path, beside its own state.
#pragma once

#include "protocols/event.hpp"
#include "protocols/status.hpp"
#include "server/tick/configuration.hpp"
#include "server/tick/outputs.hpp"
#include "server/tick/tally.hpp"

namespace parhelion::tick {

class Scripts;
struct LiveGrading;

/// Receivers of an event within the tick.
struct EventListeners {
  Scripts& scripts;
  LiveGrading* grading;  ///< null: the scenario has no training
};

struct TickContext {
  const Configuration& configuration;
  SimulationTime now;  ///< arrival of the input, or instant of the physics step
  Outputs& outputs;
  EventListeners listeners;
  Tally& tally;
};

/// Publishes an event on MR_EVENTS. Scripts and the grader receive it too.
void publish_event(const TickContext& context, const Event& event);

/// Counts a message that could not be decoded or is not allowed.
void refuse(const TickContext& context, const Error& error);

}  // namespace parhelion::tick
