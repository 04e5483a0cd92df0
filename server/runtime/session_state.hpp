// The state that a session starts with, on this machine.
#pragma once

#include <memory>

#include "server/tick/state.hpp"

namespace parhelion::runtime {

/// make_state() with a pool of `threads`, at least 1. Error: its own, or that the scenario asks for more
/// agents than the machine's free memory holds.
Result<std::unique_ptr<tick::State>> make_session_state(const tick::Configuration& configuration,
                                                        ArrivalTime start, int threads = 1);

}  // namespace parhelion::runtime
