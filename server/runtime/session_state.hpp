// The initial state of a session on this machine.
#pragma once

#include <memory>

#include "server/tick/state.hpp"

namespace parhelion::runtime {

/// make_state() with a pool of `threads`, at least 1. Error: that of make_state(), or the agents need more
/// memory than the machine has free.
Result<std::unique_ptr<tick::State>> make_session_state(const tick::Configuration& configuration,
                                                        ArrivalTime start, int threads = 1);

}  // namespace parhelion::runtime
