// The times at which the messages of a log are played: their stamps, unless these are damaged.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "protocols/time.hpp"

namespace parhelion::runtime {

/// Between two messages; a longer gap is not waited for.
inline constexpr Duration kLongestGap = seconds(60);

struct PlayTime {
  std::int64_t arrival = 0;  ///< ns; of a damaged stamp, that of the message before
  std::int64_t t = 0;        ///< ns since the first message, does not decrease
};

/// A stamp that is not followed.
struct StampFinding {
  std::size_t message = 0;  ///< index
  bool damaged = false;     ///< the stamps after it do not agree with it; else they do, after a long gap
  Duration step;            ///< from the message before it
};

struct PlayTimes {
  std::vector<PlayTime> times;  ///< one for each message
  std::vector<StampFinding> findings;
};

/// `arrivals`: ns, in the order of the log.
PlayTimes play_times(std::span<const std::int64_t> arrivals);

}  // namespace parhelion::runtime
