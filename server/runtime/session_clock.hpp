// The clock of arrivals: wall time at the start, plus the time of a monotonic clock since then. A session
// with a simulated robot may pause it, or run it faster or slower.
#pragma once

#include <mutex>

#include "protocols/time.hpp"
#include "server/runtime/wall_clock.hpp"

namespace parhelion::runtime {

/// Thread-safe.
class SessionClock {
 public:
  ArrivalTime now() const {
    const std::lock_guard lock(mutex_);
    return at(steady_now());
  }
  /// Times real time; 0: paused.
  double rate() const {
    const std::lock_guard lock(mutex_);
    return rate_;
  }
  void set_rate(double rate) {
    const std::lock_guard lock(mutex_);
    const WallTime steady = steady_now();
    arrival_at_change_ = at(steady);
    steady_at_change_ = steady;
    rate_ = rate;
  }

 private:
  ArrivalTime at(WallTime steady) const {
    return arrival_at_change_ + seconds(rate_ * (steady - steady_at_change_).seconds());
  }

  mutable std::mutex mutex_;
  ArrivalTime arrival_at_change_{wall_now().ns};
  WallTime steady_at_change_ = steady_now();
  double rate_ = 1;
};

}  // namespace parhelion::runtime
