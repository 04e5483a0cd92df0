#include "server/runtime/session_state.hpp"

#include <algorithm>

#include "protocols/available_memory.hpp"
#include "server/runtime/crowd_memory.hpp"
#include "server/runtime/thread_pool.hpp"

namespace parhelion::runtime {

Result<std::unique_ptr<tick::State>> make_session_state(const tick::Configuration& configuration,
                                                        ArrivalTime start, int threads) {
  if (const Status fits = check_crowd(configuration.scenario, available_memory()); !fits) return fits.error();
  return tick::make_state(configuration, start, std::make_unique<ThreadPool>(std::max(1, threads)));
}

}  // namespace parhelion::runtime
