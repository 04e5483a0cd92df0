// Promise 2, the robot always gets its scans: a scan that the loop does not process in time is published raw.
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

namespace parhelion::runtime {

/// The only publisher of a robot's MR_SCAN in a live server: exactly one result per scan, in the order of
/// arrival, from the loop or from the guard.
class Guard {
 public:
  /// Publishes one scan; never called concurrently, and must not wait for a slow disk or receiver.
  using Publish = std::function<void(std::span<const std::uint8_t> scan)>;
  Guard(Duration patience, Publish publish);
  /// Publishes the raw scans that have no result yet.
  ~Guard();

  /// Call at receipt of a scan, on the receiving thread. Returns its ticket, from 1.
  std::uint64_t watch(std::span<const std::uint8_t> raw_scan);
  /// Publishes the loop's result, after the earlier raw scans without a result. False: the guard has
  /// published this raw scan already.
  bool answer(std::uint64_t ticket, std::span<const std::uint8_t> scan);
  /// No result will come: publishes this raw scan, and the earlier ones without a result, immediately.
  void give_up(std::uint64_t ticket);
  std::uint64_t fired() const;

 private:
  struct Watched {
    std::uint64_t ticket = 0;
    WallTime deadline;
    std::vector<std::uint8_t> raw_scan;
  };
  void run();
  void send_oldest();
  void send_before(std::uint64_t ticket);

  const Duration patience_;
  const Publish publish_;
  // Held during publishing: otherwise the other thread could publish the next scan first.
  mutable std::mutex mutex_;
  std::condition_variable stopped_;
  std::deque<Watched> watched_;  // without result; ascending ticket, so ascending deadline
  std::uint64_t next_ticket_ = 1;
  std::uint64_t fired_ = 0;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace parhelion::runtime
