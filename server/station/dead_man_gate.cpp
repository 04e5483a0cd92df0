#include "server/station/dead_man_gate.hpp"

#include <algorithm>

#include "protocols/driving_timing.hpp"

namespace parhelion::station {

Duration PageClock::age(Duration at, WallTime now) {
  const Duration apart = Duration{now.ns} - at;
  return apart - fastest_.add(apart, now);
}

void PageClock::heard(WallTime said, Duration heard_at) {
  const Duration offset = Duration{said.ns} - heard_at;
  // A later echo has priority, since the page's clock may have been suspended.
  least_offset_ = offset;
}

std::optional<Duration> PageClock::most_age(Duration at, WallTime now) const {
  if (!least_offset_) return std::nullopt;
  return Duration{now.ns} - at - *least_offset_;
}

bool DeadManGate::pass(const PageStamp& stamp, PageClock& clock, WallTime now, const char*& why) {
  why = nullptr;
  const Duration age = clock.age(stamp.at, now);
  if (stamp.sequence <= sequence_) return false;
  sequence_ = stamp.sequence;
  const auto most = clock.most_age(stamp.at, now);
  if (age > driving_timing::command_lateness || (most && *most > driving_timing::command_max_age)) {
    hold_back();
    why = "the command was too late: stopped; release and press again";
    return false;
  }
  if (rearm_) {
    why = "release and press again: nothing moves by itself after a stop";
    return false;
  }
  held_ = true;
  last_ = now;
  return true;
}

void DeadManGate::release() { held_ = rearm_ = false; }

void DeadManGate::hold_back() {
  held_ = false;
  rearm_ = true;
}

}  // namespace parhelion::station
