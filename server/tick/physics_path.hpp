// Fixed physics steps, and the server's work at each.
#pragma once

#include "protocols/time.hpp"
#include "server/tick/outputs.hpp"

namespace parhelion::tick {

struct Configuration;
struct State;

/// Does the physics steps due at or before `until`. Called by a timer, and by tick() before each input.
void advance(const Configuration& configuration, ArrivalTime until, State& state, Outputs& outputs,
             StageObserver& stages);

}  // namespace parhelion::tick
