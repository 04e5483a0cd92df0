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

namespace parhelion::runtime {

/// The one door to MR_SCAN of a live server: exactly one answer a scan, in the order in which the scans came,
/// from the loop or from the guard.
class Guard {
 public:
  /// Sends one scan; called by one thread at a time, and must not wait for a slow disk or receiver.
  using Publish = std::function<void(std::span<const std::uint8_t> scan)>;
  Guard(Duration patience, Publish publish);
  /// What nobody has answered goes out as it came.
  ~Guard();

  /// At receipt of a scan, on the receiving thread. Gives its ticket, from 1.
  std::uint64_t watch(std::span<const std::uint8_t> raw_scan);
  /// The loop's answer: sent, after the raw scans before it that nobody has answered. False: the guard has
  /// sent this raw scan already.
  bool answer(std::uint64_t ticket, std::span<const std::uint8_t> scan);
  /// No answer will come: this raw scan, and those before it that nobody has answered, go out at once.
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
  // Held while a scan is sent: otherwise the other thread could send the next one first.
  mutable std::mutex mutex_;
  std::condition_variable stopped_;
  std::deque<Watched> watched_;  // unanswered; ascending ticket, so ascending deadline
  std::uint64_t next_ticket_ = 1;
  std::uint64_t fired_ = 0;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace parhelion::runtime
