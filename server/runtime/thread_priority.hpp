// Thread priorities where cores are few: the tick before everything else, then rendering and pages. A thread
// inherits the priority of the thread that starts it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "protocols/status.hpp"

namespace parhelion::runtime {

/// For the calling thread and those that it starts later: CPU time according to `nice` (0..19), without
/// preempting a running thread on wake-up (SCHED_BATCH).
void lower_priority(int nice);

/// Runs `task` in a thread with this lower priority, inherited by threads that it starts, and waits for it.
Status with_lower_priority(int nice, const std::function<Status()>& task);

enum class RealTime : std::uint8_t { off, on, automatic };
/// Parses "off", "on" or "auto". Error: anything else.
Result<RealTime> parse_real_time(const std::string& word);

/// During its lifetime the calling thread, and those that it starts, have priority over all non-real-time
/// threads (SCHED_FIFO, 10). Use as a local variable of that thread.
class RealTimeScope {
 public:
  /// Automatic: if permitted and there is more than one core. note() gives the result.
  explicit RealTimeScope(RealTime wanted);
  ~RealTimeScope();
  RealTimeScope(const RealTimeScope&) = delete;
  RealTimeScope& operator=(const RealTimeScope&) = delete;

  bool holds() const { return holds_; }
  /// For people: "real-time", or why not and how to change that.
  const std::string& note() const { return note_; }
  /// How to permit real-time priority to a user's programs.
  static const char* remedy();

 private:
  bool holds_ = false;
  int policy_before_ = 0, priority_before_ = 0;
  std::string note_;
};

}  // namespace parhelion::runtime
