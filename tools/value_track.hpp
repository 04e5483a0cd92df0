// Values over time, read from a log.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "protocols/time.hpp"

namespace parhelion::tools {

/// Interpolated between two samples at most `kFarthest` apart. Call sort() before at().
template <class Value>
class Track {
 public:
  static constexpr Duration kFarthest = milliseconds(1000);

  void add(SensorTime stamp, Value value) { samples_.push_back({stamp, value}); }
  bool empty() const { return samples_.empty(); }
  void sort() {
    std::stable_sort(samples_.begin(), samples_.end(),
                     [](const Sample& a, const Sample& b) { return a.stamp < b.stamp; });
  }
  /// `interpolate(a, b, s)`: the value at fraction s, 0 to 1, from a to b.
  template <class Interpolate>
  std::optional<Value> at(SensorTime t, Interpolate interpolate) const {
    const auto after = std::lower_bound(samples_.begin(), samples_.end(), t,
                                        [](const Sample& s, SensorTime stamp) { return s.stamp < stamp; });
    if (after == samples_.end()) return std::nullopt;
    if (after->stamp == t) return after->value;
    if (after == samples_.begin() || after->stamp - (after - 1)->stamp > kFarthest) return std::nullopt;
    const Sample& before = *(after - 1);
    return interpolate(before.value, after->value,
                       (t - before.stamp).seconds() / (after->stamp - before.stamp).seconds());
  }

 private:
  struct Sample {
    SensorTime stamp;
    Value value;
  };
  std::vector<Sample> samples_;
};

}  // namespace parhelion::tools
