// Estimates the start of a recording whose very first stamp may be damaged.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "protocols/arrival_order.hpp"

namespace parhelion::tools {

/// The earliest of the first stamps that agrees with most of them.
class FirstStamp {
 public:
  void add(SensorTime stamp) {
    if (head_.size() < ArrivalOrder::kConfirmed)
      head_.insert(std::upper_bound(head_.begin(), head_.end(), stamp), stamp);
  }
  /// nullopt before the first stamp.
  std::optional<SensorTime> get() const {
    if (head_.empty()) return std::nullopt;
    const SensorTime median = head_[(head_.size() - 1) / 2];
    return *std::find_if(head_.begin(), head_.end(),
                         [&](SensorTime stamp) { return stamp >= median - ArrivalOrder::kLongestSilence; });
  }

 private:
  std::vector<SensorTime> head_;  // ascending
};

}  // namespace parhelion::tools
