// Arrival stamps of consecutive events, robust against jumps of damaged stamps.
#pragma once

#include <cstdint>
#include <optional>

#include "protocols/time.hpp"

namespace parhelion {

/// Assigns each event its arrival, strictly increasing by at least 1 us. An event gets its own stamp, except
/// one that is not later than the last arrival, or more than `kLongestSilence` ahead of it, which gets last +
/// 1 us. The `confirmed`-th consecutive event that is ahead and agrees with the previous one (within
/// `kLongestSilence`) confirms a real jump: a recording that was paused, a clock that was set. From there on
/// the new stamps are followed.
class ArrivalOrder {
 public:
  static constexpr Duration kLongestSilence = seconds(300);
  static constexpr int kConfirmed = 5;

  enum class Verdict : std::uint8_t {
    own_stamp,
    not_later,  ///< than the last arrival
    ahead,      ///< too far ahead to be accepted yet
    real_leap,  ///< own stamp, after confirmed - 1 events that were `ahead`
  };
  struct Placed {
    ArrivalTime arrival;
    Verdict verdict = Verdict::own_stamp;
  };

  /// Starts as if an event had arrived at `last`. Without it, the first event's own stamp is accepted.
  void begin_after(ArrivalTime last) { last_ = last; }
  /// `trusted`: the source's stamp is accepted however far ahead.
  Placed place(ArrivalTime stamp, bool trusted = false);
  /// Notes the stamp of an event that gets no arrival here, as a sign that time passed. Stamps too far ahead
  /// are ignored.
  void see(ArrivalTime stamp);
  std::optional<ArrivalTime> last() const { return last_; }

 private:
  Placed take(ArrivalTime arrival, Verdict verdict);

  std::optional<ArrivalTime> last_, seen_;
  ArrivalTime ahead_;
  int in_a_row_ = 0;  ///< number of consecutive agreeing stamps, ahead_ included
};

}  // namespace parhelion
