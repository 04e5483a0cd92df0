#include "server/tick/clock_offset.hpp"

#include <algorithm>
#include <cstdlib>

namespace parhelion::tick {
namespace {

bool near(Duration a, Duration b, Duration limit) { return std::llabs(a.ns - b.ns) <= limit.ns; }

}  // namespace

bool ClockOffset::agrees(ArrivalTime arrival, SensorTime measured) const {
  return offset_ && near(Duration{arrival.ns - measured.ns}, *offset_, kStep);
}

bool ClockOffset::add(ArrivalTime arrival, SensorTime measured) {
  const Duration sample{arrival.ns - measured.ns};
  if (!offset_) {
    offset_ = sample;
    last_arrival_ = arrival;
    return true;
  }
  if (!near(sample, *offset_, kStep)) {
    outliers_ = outliers_ > 0 && near(sample, candidate_, kStep) ? outliers_ + 1 : 1;
    candidate_ = sample;
    if (outliers_ < kConfirm) return false;
    offset_ = sample;
    outliers_ = 0;
    last_arrival_ = arrival;
    return true;
  }
  outliers_ = 0;
  const Duration risen = *offset_ + seconds((arrival - last_arrival_).seconds() * kSlew);
  offset_ = std::min(sample, risen);
  last_arrival_ = arrival;
  return true;
}

}  // namespace parhelion::tick
