// The watchdog on MR_CMD: silence means stop, and so does a command that is old or repeated.
#pragma once

#include <cstdint>
#include <optional>

#include "geometry.hpp"

namespace robot {

class CommandWatch {
 public:
  static constexpr std::int64_t kSilence = 300'000;   // us without a command: stop
  static constexpr std::int64_t kLateness = 250'000;  // us behind the fastest command so far: old

  // A command with stamp `utime` of the console's clock has come at `now`, this robot's clock. The clocks
  // need not agree. A stop is always obeyed, and a value that is not a number counts as a stop. A motion is
  // obeyed only if it is new. Returns whether the command is obeyed.
  bool receive(const Twist2& command, std::int64_t utime, std::int64_t now);

  // What the motors may do at `now`.
  Twist2 command(std::int64_t now) const;
  // Whether stops are coming now: an emergency stop, for a robot that drives itself, too.
  bool is_stopped(std::int64_t now) const;

 private:
  // Sender: what its commands have in common.
  struct Sender {
    std::int64_t utime;   // of the newest command
    std::int64_t offset;  // smallest difference between arrival and stamp
    int commands = 1;
    bool follows(std::int64_t next, std::int64_t now) const;
    void add(std::int64_t next, std::int64_t now);
  };
  bool is_new(std::int64_t utime, std::int64_t now);

  static constexpr int kConfirm = 5;  // commands in a row with which another console takes over
  std::optional<Sender> sender_, candidate_;
  Twist2 command_;
  std::int64_t received_ = -kSilence;  // when the last command was obeyed
};

}  // namespace robot
