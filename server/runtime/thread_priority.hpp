// Which thread goes first where cores are few: the tick before all else, rendering and pages after it. A
// thread has the priority of who starts it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "protocols/status.hpp"

namespace parhelion::runtime {

/// Of the calling thread, and of those that it starts from now on: it has its share of the cores by `nice`
/// (0..19), but never takes one from a thread that runs already because it has just been woken (SCHED_BATCH).
void give_way(int nice);

/// Runs `task` in a thread that gives way so, and waits for it: what it starts gives way, too.
Status while_giving_way(int nice, const std::function<Status()>& task);

enum class RealTime : std::uint8_t { off, on, automatic };
/// "off", "on" or "auto". Error: it is none of them.
Result<RealTime> parse_real_time(const std::string& word);

/// The calling thread, and those that it starts meanwhile, go before all others of the machine that are not
/// real-time (SCHED_FIFO, 10), as long as this lives. Of its own thread, as a local variable.
class RealTimeScope {
 public:
  /// Automatic: where it is allowed and there is more than one core. What it led to is in note().
  explicit RealTimeScope(RealTime wanted);
  ~RealTimeScope();
  RealTimeScope(const RealTimeScope&) = delete;
  RealTimeScope& operator=(const RealTimeScope&) = delete;

  bool holds() const { return holds_; }
  /// For people: "real-time", or why not and what to do about it.
  const std::string& note() const { return note_; }
  /// What lets a user's programs be real-time.
  static const char* remedy();

 private:
  bool holds_ = false;
  int policy_before_ = 0, priority_before_ = 0;
  std::string note_;
};

}  // namespace parhelion::runtime
