// Fixed physics steps, and what the server does at each.
#pragma once

#include "protocols/time.hpp"
#include "server/tick/outputs.hpp"

namespace parhelion::tick {

struct Configuration;
struct State;

/// Does the physics steps due at or before `until`: what a timer calls, and tick() before it handles an
/// input.
void advance(const Configuration& configuration, ArrivalTime until, State& state, Outputs& outputs,
             StageObserver& stages);

}  // namespace parhelion::tick
