// Inputs as they come, each with a strictly increasing arrival stamp: the only place that knows wall time.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>

#include "protocols/bus/bus.hpp"
#include "server/configuration.hpp"
#include "server/guard.hpp"
#include "server/wall_clock.hpp"

namespace parhelion {

struct Arrived {
  Message message;
  std::uint64_t ticket = 0;  ///< the guard's, for scans
  WallTime received;         ///< steady clock, at receipt
};

/// A thread receives, so that the guard hears of a scan even while the loop is held up; the loop takes.
/// Bounded: where the loop falls behind, the oldest input that is not a scan or a command goes, and is
/// counted.
class Inbox {
 public:
  Inbox(Bus& bus, const ChannelMap& channels, Guard& guard);
  ~Inbox();

  /// The next input, stamped; nullopt: none came until `deadline` (steady clock).
  std::optional<Arrived> take(WallTime deadline);
  /// Wall time at the start plus what a clock that never jumps has counted since.
  ArrivalTime now() const;
  /// A stamp for a decision of the loop, or for a timer tick: later than all before it.
  ArrivalTime stamp();
  std::uint64_t dropped() const;
  std::string fault() const;  ///< why receiving has ended, or empty

 private:
  static constexpr std::size_t capacity = 256;
  void run();
  void push(Message message);

  Bus& bus_;
  const ChannelMap& channels_;
  Guard& guard_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Arrived> queue_;
  std::uint64_t dropped_ = 0;
  std::string fault_;
  const WallTime wall_start_ = wall_now(), steady_start_ = steady_now();
  ArrivalTime last_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace parhelion
