// Which commands of a page may move a robot: in time, in order, while the dead-man is held, and after a stop
// only once it was let go.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "protocols/driving_timing.hpp"
#include "protocols/time.hpp"
#include "server/station/running_minimum.hpp"

namespace parhelion::station {

/// What a page says with each command: its own clock and count.
struct PageStamp {
  std::uint64_t sequence = 0;  ///< rises
  Duration at;                 ///< when it left, the page's clock
};

/// How old a message of a page is, from what both clocks said. Bounds a page's clock offset from both sides:
/// a message arrives after it left (above), and an answer is heard after it was given (below).
class PageClock {
 public:
  /// Of a message that left `at` and is here `now`: counted from the fastest of the last minutes.
  Duration age(Duration at, WallTime now);
  /// The page heard at `heard_at` (its clock) what was said here at `said`.
  void heard(WallTime said, Duration heard_at);
  /// That a message is not older than this is certain; nullopt: the page has echoed nothing.
  std::optional<Duration> most_age(Duration at, WallTime now) const;

 private:
  RunningMinimum fastest_{seconds(60)};
  std::optional<Duration> least_offset_;  // of the server's clock from the page's
};

/// Not thread-safe. Instants are one steady clock.
class DeadManGate {
 public:
  /// May this command move the robot? Else why not; the robot has to be stopped, and `rearm` holds from then.
  /// A command that is out of order is left out without a word and stops nothing (nullptr in `why`).
  bool pass(const PageStamp& stamp, PageClock& clock, WallTime now, const char*& why);
  /// The dead-man is let go: what comes next may move again.
  void release();
  /// It must be let go before anything moves.
  void hold_back();
  /// Held, and nothing came for page_silence.
  bool fell_silent(WallTime now) const { return held_ && now - last_ >= driving_timing::page_silence; }
  bool held() const { return held_; }
  bool must_rearm() const { return rearm_; }

 private:
  bool held_ = false, rearm_ = true;
  std::uint64_t sequence_ = 0;
  WallTime last_;
};

}  // namespace parhelion::station
