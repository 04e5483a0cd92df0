#include "server/tick/cadence.hpp"

#include <cmath>

namespace parhelion::tick {

bool Cadence::due(Duration since_start) {
  // A step's instant is rounded to nanoseconds: tolerate half a microsecond.
  const auto periods = static_cast<std::int64_t>(std::floor((since_start.seconds() + 5e-7) * rate_));
  if (periods == last_) return false;
  last_ = periods;
  return true;
}

}  // namespace parhelion::tick
