#include "server/runtime/play/play_times.hpp"

#include <algorithm>

namespace parhelion::runtime {
namespace {

constexpr std::size_t kWitnesses = 5;
constexpr std::int64_t kTolerance = 1'000'000'000;  // ns by which stamps may go back

/// Whether most of the next messages satisfy `is`.
template <class Predicate>
bool majority_after(std::span<const std::int64_t> arrivals, std::size_t i, Predicate is) {
  const auto next = arrivals.subspan(i + 1, std::min(kWitnesses, arrivals.size() - i - 1));
  return 2 * std::count_if(next.begin(), next.end(), is) > static_cast<std::ptrdiff_t>(next.size());
}

bool follows(std::int64_t stamp, std::int64_t before) {
  return stamp >= before - kTolerance && stamp <= before + kLongestGap.ns;
}

}  // namespace

PlayTimes play_times(std::span<const std::int64_t> arrivals) {
  PlayTimes played;
  if (arrivals.empty()) return played;
  const auto is_ahead = [&](std::size_t i) {
    return majority_after(arrivals, i, [&](std::int64_t next) { return next < arrivals[i] - kTolerance; });
  };
  std::int64_t last = arrivals.size() > 1 && is_ahead(0) ? arrivals[1] : arrivals[0];
  std::int64_t t = 0, start = last;  // start: the arrival that is played at t = 0
  for (std::size_t i = 0; i < arrivals.size(); ++i) {
    const std::int64_t stamp = arrivals[i];
    const bool ahead = is_ahead(i);
    if (follows(stamp, last) && !ahead) {
      last = stamp;
    } else {
      const bool confirmed =
          !ahead && majority_after(arrivals, i, [&](std::int64_t next) { return follows(next, stamp); });
      played.findings.push_back({i, !confirmed, Duration{stamp - last}});
      if (confirmed) {
        last = stamp;
        start = stamp - t;  // without the gap
      }
    }
    t = std::max(t, last - start);
    played.times.push_back({last, t});
  }
  return played;
}

}  // namespace parhelion::runtime
