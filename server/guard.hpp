// The robot never goes blind (promise 2): a scan that the loop has not answered in time goes out as it came.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "protocols/time.hpp"

namespace parhelion {

/// Each scan has a ticket; whoever claims it first, loop or guard, sends the answer, the other does not.
class Guard {
 public:
  using Publish = std::function<void(std::span<const std::uint8_t> raw_scan)>;
  Guard(Duration patience, Publish publish_raw);
  ~Guard();

  /// At receipt of a scan, on the receiving thread.
  std::uint64_t watch(std::span<const std::uint8_t> raw_scan);
  /// By the loop, when its answer is ready. False: the guard has sent the raw scan.
  bool claim(std::uint64_t ticket);
  std::uint64_t fired() const;

 private:
  struct Watched {
    std::uint64_t ticket = 0;
    WallTime deadline;
    std::vector<std::uint8_t> raw_scan;
    bool claimed = false;
  };
  void run();

  const Duration patience_;
  const Publish publish_raw_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Watched> watched_;  // ascending ticket, so ascending deadline
  std::uint64_t next_ticket_ = 1;
  std::uint64_t fired_ = 0;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace parhelion
