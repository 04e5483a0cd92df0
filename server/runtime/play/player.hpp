// Plays a recording: what was said goes out again in its time, paused, faster, or from another place.
#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "protocols/time.hpp"
#include "server/runtime/play/recording.hpp"

namespace parhelion::runtime {

struct PlayState {
  bool paused = false;
  bool ended = false;   ///< at the end, and it does not begin again
  double rate = 1;      ///< times real time
  double position = 0;  ///< s after the session began
  double duration = 0;  ///< s
};

struct PlayOptions {
  double rate = 1;
  double start = 0;  ///< s after the session began
  bool loop = false;
  bool paused = false;
};

/// Thread-safe, and reads no clock: whoever owns it calls turn(). Everything recorded goes to `send`, in the
/// order of the log.
class Player {
 public:
  static constexpr double slowest = 0.01, fastest = 100;  // times real time

  Player(Recording recording, const PlayOptions& options, std::function<void(const Message&)> send);

  /// Sends what is due at `now` (steady clock). How long until there is more to do; at most 50 ms. Error: the
  /// log cannot be read; it has then ended.
  Result<Duration> turn(WallTime now);

  void pause(bool paused);
  /// Error: not within slowest..fastest.
  Status set_rate(double rate);
  /// Goes there with the next turn(): whoever listens knows then what one knows who has heard everything up
  /// to there; going back begins with MR_SESSION. Beyond an end: to that end. Error: not finite.
  Status seek(double position);
  /// While paused: the next message, alone. Error: it plays.
  Status step();

  PlayState state() const;
  /// Where the recording is, on the clock of its arrivals.
  ArrivalTime clock() const;
  const Recording& recording() const { return recording_; }

 private:
  Status send(std::size_t i);
  Status jump(double position);
  void move_to(WallTime now);

  const Recording recording_;
  const bool loop_;
  const std::function<void(const Message&)> send_;
  mutable std::mutex mutex_;
  Message message_;
  std::size_t next_ = 0;  ///< not sent yet
  bool paused_ = false, ended_ = false;
  std::size_t steps_ = 0;  ///< asked for
  double rate_ = 1, position_ = 0;
  std::optional<double> wanted_;  ///< s: to go there
  std::optional<WallTime> at_;    ///< when position_ was right; none: the clock stands
};

}  // namespace parhelion::runtime
