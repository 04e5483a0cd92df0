#include "server/tick/command_clock.hpp"

#include <algorithm>
#include <cstdlib>

#include "protocols/driving_timing.hpp"

namespace parhelion::tick {

bool CommandClock::Sender::add(ArrivalTime newer, SensorTime newer_stamp, Duration tolerance) {
  const Duration sample{newer.ns - newer_stamp.ns};
  if (newer_stamp <= stamp || std::llabs(sample.ns - offset.ns) > tolerance.ns) return false;
  offset = std::min(sample, offset + seconds((newer - arrival).seconds() * kSlew));
  arrival = newer;
  stamp = newer_stamp;
  ++commands;
  return true;
}

bool CommandClock::is_new(ArrivalTime arrival, SensorTime stamp) {
  const Sender first{{arrival.ns - stamp.ns}, arrival, stamp};
  if (!sender_) {
    sender_ = first;
  } else if (!sender_->add(arrival, stamp, driving_timing::kCommandLateness)) {
    if (!candidate_ || !candidate_->add(arrival, stamp, kAgreement)) candidate_ = first;
    if (candidate_->commands < kConfirm) return false;
    sender_ = candidate_;
  }
  candidate_.reset();
  return true;
}

}  // namespace parhelion::tick
