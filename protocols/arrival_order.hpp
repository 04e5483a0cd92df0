// Arrival stamps of events that come one after another, without the leaps that damaged stamps would make.
#pragma once

#include <cstdint>
#include <optional>

#include "protocols/time.hpp"

namespace parhelion {

/// Gives each event its arrival, strictly increasing by at least 1 us. An event goes by its own stamp, except
/// that one which is not later than the last arrival, or more than `longest_silence` ahead of it, gets
/// last + 1 us. The `confirmed`-th in a row that is ahead and agrees with the one before (within
/// `longest_silence`) shows that the leap is real: a recording that was paused, a clock that was set. The
/// order follows it from there.
class ArrivalOrder {
 public:
  static constexpr Duration longest_silence = seconds(300);
  static constexpr int confirmed = 5;

  enum class Verdict : std::uint8_t {
    own_stamp,
    not_later,  ///< than the last arrival
    ahead,      ///< too far to be believed yet
    real_leap,  ///< own stamp, after confirmed - 1 that were `ahead`
  };
  struct Placed {
    ArrivalTime arrival;
    Verdict verdict = Verdict::own_stamp;
  };

  /// As if an event had arrived at `last`. Without it, the first event's own stamp is believed.
  void begin_after(ArrivalTime last) { last_ = last; }
  /// `trusted`: by whom it comes its stamp is right however far ahead.
  Placed place(ArrivalTime stamp, bool trusted = false);
  /// Something that gets no arrival here, but shows that time passed. What is too far ahead is not believed.
  void see(ArrivalTime stamp);
  std::optional<ArrivalTime> last() const { return last_; }

 private:
  Placed take(ArrivalTime arrival, Verdict verdict);

  std::optional<ArrivalTime> last_, seen_;
  ArrivalTime ahead_;
  int in_a_row_ = 0;  ///< ahead_ and those before it that agree
};

}  // namespace parhelion
