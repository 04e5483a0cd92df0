#include "server/station/dead_man_gate.hpp"

#include <algorithm>

#include "protocols/driving_timing.hpp"

namespace parhelion::station {

Duration ClientClock::age(Duration at, WallTime now) {
  const Duration apart = Duration{now.ns} - at;
  return apart - fastest_.add(apart, now);
}

void ClientClock::handle_pong(WallTime sent, Duration received_at) {
  const Duration offset = Duration{sent.ns} - received_at;
  // A later echo has priority, since the page's clock may have been suspended.
  min_offset_ = offset;
}

std::optional<Duration> ClientClock::max_age(Duration at, WallTime now) const {
  if (!min_offset_) return std::nullopt;
  return Duration{now.ns} - at - *min_offset_;
}

bool DeadManGate::pass(const ClientStamp& stamp, ClientClock& clock, WallTime now, const char*& why) {
  why = nullptr;
  const Duration age = clock.age(stamp.at, now);
  if (stamp.sequence <= sequence_) return false;
  sequence_ = stamp.sequence;
  const auto largest_age = clock.max_age(stamp.at, now);
  if (age > driving_timing::kCommandLateness ||
      (largest_age && *largest_age > driving_timing::kMaxClockAge)) {
    require_release();
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

void DeadManGate::require_release() {
  held_ = false;
  rearm_ = true;
}

}  // namespace parhelion::station
