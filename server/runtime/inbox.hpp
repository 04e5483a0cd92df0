// Inputs as they come, each with a strictly increasing arrival stamp: the only place that knows wall time.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "server/runtime/guard.hpp"
#include "server/runtime/sent_messages.hpp"
#include "server/runtime/session_clock.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::runtime {

struct Arrived {
  Message message;
  std::uint64_t ticket = 0;  ///< the guard's, for scans
  WallTime received;         ///< steady clock, at receipt
};

/// What waits for a loop that is held up. Scans and commands are kept by their size: at ten scans of 361
/// beams a second, an hour.
struct InboxLimits {
  std::size_t others = 256;                   ///< inputs that are no scans and no commands: the oldest goes
  std::size_t bytes = std::size_t{64} << 20;  ///< of scans and commands
};

/// A thread receives, so that the guard hears of a scan even while the loop is held up; the loop takes.
/// Bounded, and what goes is counted. Beyond `bytes` the oldest scan is given up to the guard, so that it
/// goes out as it came; where none waits, the newest command goes, which nobody has acknowledged.
class Inbox {
 public:
  /// `sent`: what is on its channels and not ours is counted, by take_foreign().
  /// `clock`: of the session; none: one of its own.
  Inbox(Bus& bus, const tick::ChannelMap& channels, Guard& guard, InboxLimits limits = {},
        const SentMessages* sent = nullptr, std::shared_ptr<const SessionClock> clock = nullptr);
  ~Inbox();

  /// Takes what the bus holds, then receives no more; what waits can still be taken.
  void close();

  /// The next input, stamped; nullopt: none came until `deadline` (steady clock), or wake() was called.
  std::optional<Arrived> take(WallTime deadline);
  /// Ends the wait of take(), or of the next one: there is something else to do than to handle an input.
  void wake();
  /// As the session's clock has it.
  ArrivalTime now() const { return clock_->now(); }
  /// A stamp for a decision of the loop, or for a timer tick: later than all before it.
  ArrivalTime stamp();
  std::uint64_t dropped() const;
  /// Scans given up to the guard since the last call: the session log lacks them.
  std::uint64_t take_given_up();
  /// Channels (as SentMessages::foreign() has them) on which others have published since the last call,
  /// ascending; each at most once a minute. Who it was no message says.
  std::vector<std::int64_t> take_foreign(WallTime now);
  std::string fault() const;  ///< why receiving has ended, or empty

 private:
  void run();
  void push(Message message);
  void note_foreign(const Message& message);
  bool make_room(tick::InputKind kind, std::size_t size);
  void drop(std::deque<Arrived>::iterator waiting);
  void forget(const Arrived& leaving);
  std::deque<Arrived>::iterator oldest(bool (*wanted)(tick::InputKind));

  Bus& bus_;
  const tick::ChannelMap& channels_;
  Guard& guard_;
  const InboxLimits limits_;
  const SentMessages* sent_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Arrived> queue_;
  std::size_t others_ = 0, bytes_ = 0;  // in the queue, as in the limits
  std::uint64_t dropped_ = 0, given_up_ = 0;
  std::set<std::int64_t> foreign_;
  std::map<std::int64_t, WallTime> foreign_taken_;  // when each was taken last
  std::string fault_;
  bool woken_ = false;
  const std::shared_ptr<const SessionClock> clock_;
  ArrivalTime last_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace parhelion::runtime
