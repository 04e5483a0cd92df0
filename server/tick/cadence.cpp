#include "server/tick/cadence.hpp"

#include <cmath>

namespace parhelion::tick {

bool Cadence::due(Duration since_start) {
  // A step is a rounded number of nanoseconds after the start: half a microsecond decides nothing.
  const auto periods = static_cast<std::int64_t>(std::floor((since_start.seconds() + 5e-7) * rate_));
  if (periods == last_) return false;
  last_ = periods;
  return true;
}

}  // namespace parhelion::tick
