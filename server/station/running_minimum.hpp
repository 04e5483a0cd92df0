// The least of what was seen lately: of (arrival - sender's clock) it is the sender's clock offset plus the
// fastest way, whatever queues the others stood in.
#pragma once

#include <algorithm>
#include <optional>

#include "protocols/time.hpp"

namespace parhelion::station {

/// Over the last `window` to twice that, so that a clock that drifts, or slept, is believed again.
class RunningMinimum {
 public:
  explicit RunningMinimum(Duration window) : window_(window) {}

  /// The minimum, this value included. `now` never goes back.
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
