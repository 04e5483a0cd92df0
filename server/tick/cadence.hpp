// When a message that is sent at a fixed rate is due.
#pragma once

#include <cstdint>

#include "protocols/time.hpp"

namespace parhelion::tick {

/// Due times of messages at a fixed rate: a message is due at the first step at or after each multiple of the
/// period. A loop that skipped steps sends it once.
class Cadence {
 public:
  explicit Cadence(double rate) : rate_(rate) {}
  bool due(Duration since_start);

 private:
  double rate_;  ///< Hz
  std::int64_t last_ = -1;
};

}  // namespace parhelion::tick
