// Whether a command is new, by its sender's clock.
#pragma once

#include <optional>

#include "protocols/time.hpp"

namespace parhelion::tick {

/// Senders' clocks may differ from the server's: the offset is that of the fastest message so far, slewed. A
/// command that is kCommandLateness late against it, or whose stamp does not advance, is not new. Another
/// sender, or a clock that was set, is followed once kConfirm commands in a row agree on a new offset. A
/// message repeated for ever, or a queue that empties at once, never does.
class CommandClock {
 public:
  /// The first command of all is new.
  bool is_new(ArrivalTime arrival, SensorTime stamp);

 private:
  static constexpr Duration kAgreement = milliseconds(30);
  static constexpr int kConfirm = 5;
  static constexpr double kSlew = 1e-4;  // s/s: an uncompensated quartz drifts by less

  struct Sender {
    Duration offset;      ///< smallest arrival - stamp
    ArrivalTime arrival;  ///< of the newest command
    SensorTime stamp;     ///< the same
    int commands = 1;
    /// False: the command is not this sender's, within `tolerance`.
    bool add(ArrivalTime newer, SensorTime newer_stamp, Duration tolerance);
  };
  std::optional<Sender> sender_, candidate_;
};

}  // namespace parhelion::tick
