#include "protocols/arrival_order.hpp"

#include <algorithm>

namespace parhelion {
namespace {

/// Damaged stamps may have any value: the difference of two need not fit an int64.
bool silent_between(ArrivalTime earlier, ArrivalTime later) {
  return later > earlier && static_cast<std::uint64_t>(later.ns) - static_cast<std::uint64_t>(earlier.ns) >
                                static_cast<std::uint64_t>(ArrivalOrder::kLongestSilence.ns);
}

}  // namespace

ArrivalOrder::Placed ArrivalOrder::place(ArrivalTime stamp, bool trusted) {
  if (!last_) return take(stamp, Verdict::own_stamp);
  const ArrivalTime next = *last_ + microseconds(1);
  if (stamp <= *last_) return take(next, Verdict::not_later);
  if (trusted || !silent_between(std::max(*last_, seen_.value_or(*last_)), stamp)) {
    in_a_row_ = 0;
    return take(stamp, Verdict::own_stamp);
  }
  const bool agrees = !silent_between(ahead_, stamp) && !silent_between(stamp, ahead_);
  in_a_row_ = in_a_row_ > 0 && agrees ? in_a_row_ + 1 : 1;
  ahead_ = stamp;
  if (in_a_row_ < kConfirmed) return take(next, Verdict::ahead);
  in_a_row_ = 0;
  return take(stamp, Verdict::real_leap);
}

void ArrivalOrder::see(ArrivalTime stamp) {
  if (!seen_ || !silent_between(*seen_, stamp)) seen_ = std::max(seen_.value_or(stamp), stamp);
}

ArrivalOrder::Placed ArrivalOrder::take(ArrivalTime arrival, Verdict verdict) {
  last_ = arrival;
  return {arrival, verdict};
}

}  // namespace parhelion
