// The two samples that bracket an instant, for sensors that report values without rates.
#pragma once

#include <optional>

#include "fusion/pose/tracks/ring.hpp"

namespace parhelion::pose {

template <class Sample>
struct Bracket {
  const Sample* before;
  const Sample* after;  ///< the same as `before` after the newest sample
  double s;             ///< 0 at before, 1 at after
};

/// Two samples at most `longest_gap` apart, or the newest for at most that long. None: t is too old, too far
/// ahead, or in a gap.
template <class Sample>
std::optional<Bracket<Sample>> bracket(const Ring<Sample>& samples, SensorTime t, Duration longest_gap) {
  const std::size_t age = samples.age_at(t);
  if (age == samples.count()) return std::nullopt;
  const Sample& before = samples.newest(age);
  if (age == 0) {
    if (t - before.stamp > longest_gap) return std::nullopt;
    return Bracket<Sample>{&before, &before, 0};
  }
  const Sample& after = samples.newest(age - 1);
  const Duration gap = after.stamp - before.stamp;
  if (gap > longest_gap) return std::nullopt;
  return Bracket<Sample>{&before, &after, (t - before.stamp).seconds() / gap.seconds()};
}

/// Stores the sample, or rejects a backward stamp. A stamp more than two seconds back means that the sensor's
/// clock restarted; the history is cleared.
template <class Sample>
bool push_in_order(const Sample& sample, Ring<Sample>& samples) {
  constexpr Duration restart = seconds(2.0);
  if (samples.count() > 0 && sample.stamp <= samples.newest().stamp) {
    if (samples.newest().stamp - sample.stamp <= restart) return false;
    samples.clear();
  }
  samples.push(sample);
  return true;
}

}  // namespace parhelion::pose
