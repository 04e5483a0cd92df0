// Plays a recording: publishes its messages in real time, faster or slower, with pause and seek.
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
  bool ended = false;   ///< at the end, without repeat
  double rate = 1;      ///< times real time
  double position = 0;  ///< s since the session's start
  double duration = 0;  ///< s
};

struct PlayOptions {
  double rate = 1;
  double start = 0;  ///< s since the session's start
  bool loop = false;
  bool paused = false;
};

/// Thread-safe, and reads no clock: the owner calls turn(). All recorded messages are passed to `send`, in
/// the order of the log.
class Player {
 public:
  static constexpr double kSlowest = 0.01, kFastest = 100;  // times real time

  Player(Recording recording, const PlayOptions& options, std::function<void(const Message&)> send);

  /// Sends messages due at `now` (steady clock). Returns the time until the next call; at most 50 ms. Error:
  /// the log cannot be read; playing has then ended.
  Result<Duration> turn(WallTime now);

  void pause(bool paused);
  /// Error: outside slowest..fastest.
  Status set_rate(double rate);
  /// Jumps to `position` at the next turn(): receivers then get the state of a receiver that got everything
  /// up to it; going back begins with MR_SESSION. Clamped to the recording. Error: not finite.
  Status seek(double position);
  /// While paused: sends one message. Error: not paused.
  Status step();

  PlayState state() const;
  /// Current position on the clock of arrivals.
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
  std::size_t next_ = 0;  ///< index of the next message
  bool paused_ = false, ended_ = false;
  std::size_t steps_ = 0;  ///< requested by step()
  double rate_ = 1, position_ = 0;
  std::optional<double> wanted_;  ///< s: requested by seek()
  std::optional<WallTime> at_;    ///< instant of position_; none: paused
};

}  // namespace parhelion::runtime
