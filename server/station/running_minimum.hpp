// Minimum over recent values. Applied to (arrival - sender's clock), it gives the sender's clock offset plus
// the smallest network delay, free of queueing delay.
#pragma once

#include <algorithm>
#include <optional>

#include "protocols/time.hpp"

namespace parhelion::station {

/// Over the last `window` to twice that, so that the estimate follows a clock that drifts or was suspended.
class RunningMinimum {
 public:
  explicit RunningMinimum(Duration window) : window_(window) {}

  /// The minimum, this value included. `now` is monotonic.
  Duration add(Duration value, WallTime now) {
    if (!current_ || now - began_ >= window_) {
      previous_ = current_ && now - began_ < window_ + window_ ? current_ : std::nullopt;
      current_ = value;
      began_ = now;
    }
    current_ = std::min(*current_, value);
    return std::min(*current_, previous_.value_or(*current_));
  }
  void forget() { current_.reset(), previous_.reset(); }

 private:
  Duration window_;
  WallTime began_;
  std::optional<Duration> current_, previous_;
};

}  // namespace parhelion::station
