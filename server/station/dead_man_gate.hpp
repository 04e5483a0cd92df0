// Decides which commands of a page may move a robot: recent, in order, with the dead-man held, and after a
// stop only after it was released once.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "protocols/driving_timing.hpp"
#include "protocols/time.hpp"
#include "server/station/running_minimum.hpp"

namespace parhelion::station {

/// The page's clock and counter, sent with each command.
struct ClientStamp {
  std::uint64_t sequence = 0;  ///< increases
  Duration at;                 ///< send time on the page's clock
};

/// Estimates the age of a page's messages. Bounds the offset of the page's clock from both sides: a message
/// arrives after it was sent (upper bound), and a reply is received after it was sent (lower bound).
class ClientClock {
 public:
  /// Age of a message that was sent at `at` and arrived at `now`, relative to the fastest message of the last
  /// minutes.
  Duration age(Duration at, WallTime now);
  /// The page received at `received_at` (its clock) what this server sent at `sent`.
  void handle_pong(WallTime sent, Duration received_at);
  /// Upper bound on the age of a message; nullopt: the page has echoed nothing yet.
  std::optional<Duration> max_age(Duration at, WallTime now) const;

 private:
  RunningMinimum fastest_{seconds(60)};
  std::optional<Duration> min_offset_;  // of the server's clock relative to the page's
};

/// Not thread-safe. Instants are of one steady clock.
class DeadManGate {
 public:
  /// True if this command may move the robot. Otherwise `why` is the reason, the robot has to be stopped, and
  /// commands are refused until the dead-man was released. A command out of order is dropped and stops
  /// nothing (nullptr in `why`).
  bool pass(const ClientStamp& stamp, ClientClock& clock, WallTime now, const char*& why);
  /// The dead-man was released: the next command may move the robot again.
  void release();
  /// Refuses all commands until the dead-man was released.
  void require_release();
  /// The dead-man is held, and no command arrived for kClientSilence.
  bool fell_silent(WallTime now) const { return held_ && now - last_ >= driving_timing::kClientSilence; }
  bool held() const { return held_; }
  bool must_rearm() const { return rearm_; }

 private:
  bool held_ = false, rearm_ = true;
  std::uint64_t sequence_ = 0;
  WallTime last_;
};

}  // namespace parhelion::station
