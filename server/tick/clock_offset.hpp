// The offset between a robot's clock and the server's: running minimum of (arrival - measured instant),
// slewed.
#pragma once

#include <cstdint>
#include <optional>

#include "protocols/time.hpp"

namespace parhelion::tick {

/// One per clock: all sensors of a robot share it, so that different latencies do not shift them against each
/// other. The minimum corresponds to the lowest latency seen; it may rise by `slew` to follow a drifting
/// clock. A sample further than `step` away is an outlier until `confirm` of them in a row agree: then the
/// clock was set, and the offset follows.
class ClockOffset {
 public:
  /// `measured`: the last instant that the message covers (a scan's last beam), so that the offset is never
  /// late. False: an outlier; the message's stamp is not to be trusted.
  bool add(ArrivalTime arrival, SensorTime measured);
  /// The same, without learning from it. False, too, if the offset is not known yet.
  bool agrees(ArrivalTime arrival, SensorTime measured) const;
  bool known() const { return offset_.has_value(); }
  /// On the server's clock. Requires known().
  SimulationTime to_server(SensorTime t) const { return {t.ns + offset_->ns}; }
  SensorTime to_sensor(SimulationTime t) const { return {t.ns - offset_->ns}; }
  Duration offset() const { return *offset_; }

 private:
  static constexpr double kSlew = 1e-4;            // s/s: an uncompensated quartz drifts by less
  static constexpr Duration kStep = seconds(1.0);  // beyond any plausible latency of a local network
  static constexpr int kConfirm = 5;

  std::optional<Duration> offset_;
  ArrivalTime last_arrival_;
  Duration candidate_;
  int outliers_ = 0;
};

}  // namespace parhelion::tick
