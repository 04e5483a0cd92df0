#include "server/runtime/guard.hpp"

#include <gtest/gtest.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <vector>

#include "server/runtime/wall_clock.hpp"

namespace parhelion::runtime {
namespace {

std::vector<std::uint8_t> scan_bytes(std::uint8_t first) { return {first, 2, 3}; }

/// Keeps the first byte of each published scan, in order.
class Sent {
 public:
  Guard::Publish publisher() {
    return [this](std::span<const std::uint8_t> scan) {
      const std::lock_guard lock(mutex_);
      first_bytes_.push_back(scan[0]);
      changed_.notify_all();
    };
  }
  bool wait_for(std::size_t total) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(20), [&] { return first_bytes_.size() >= total; });
  }
  std::vector<int> all() {
    const std::lock_guard lock(mutex_);
    return first_bytes_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<int> first_bytes_;
};

TEST(Guard, SendsTheRawScanIfTheLoopIsLate) {
  Sent sent;
  Guard guard(milliseconds(5), sent.publisher());
  const std::uint64_t ticket = guard.watch(scan_bytes(7));
  ASSERT_TRUE(sent.wait_for(1));
  EXPECT_FALSE(guard.answer(ticket, scan_bytes(8))) << "the loop must not answer as well";
  EXPECT_EQ(sent.all(), (std::vector<int>{7}));
  EXPECT_EQ(guard.fired(), 1U);
}

TEST(Guard, SendsNothingIfTheLoopWasFirst) {
  Sent sent;
  {
    Guard guard(seconds(100), sent.publisher());
    for (int i = 0; i < 200; ++i) EXPECT_TRUE(guard.answer(guard.watch(scan_bytes(1)), scan_bytes(2)));
    EXPECT_EQ(guard.fired(), 0U);
  }
  EXPECT_EQ(sent.all(), std::vector<int>(200, 2));
}

TEST(Guard, EachScanIsSentOnceAndInOrderUnderRaces) {
  Sent sent;
  std::uint64_t answered_by_loop = 0;
  constexpr int scans = 600;
  std::uint64_t fired = 0;
  {
    Guard guard(microseconds(200), sent.publisher());
    std::deque<std::uint64_t> waiting;
    for (int i = 0; i < scans; ++i) {
      waiting.push_back(guard.watch(scan_bytes(static_cast<std::uint8_t>(i % 251))));
      const WallTime until = steady_now() + microseconds(40 + 60 * (i % 5));
      while (steady_now() < until) {
      }
      // The loop is up to three scans behind, so that the guard fires between its results.
      while (waiting.size() > static_cast<std::size_t>(i % 4)) {
        const std::uint64_t ticket = waiting.front();
        waiting.pop_front();
        answered_by_loop +=
            guard.answer(ticket, scan_bytes(static_cast<std::uint8_t>((ticket - 1) % 251))) ? 1 : 0;
      }
    }
    while (!waiting.empty()) {
      guard.give_up(waiting.front());
      waiting.pop_front();
    }
    fired = guard.fired();
  }
  EXPECT_EQ(answered_by_loop + fired, static_cast<std::uint64_t>(scans));
  const std::vector<int> all = sent.all();
  ASSERT_EQ(all.size(), static_cast<std::size_t>(scans));
  for (int i = 0; i < scans; ++i) ASSERT_EQ(all[static_cast<std::size_t>(i)], i % 251) << "scan " << i;
}

TEST(Guard, SendsSkippedScansBeforeALaterOne) {
  Sent sent;
  Guard guard(seconds(100), sent.publisher());
  guard.watch(scan_bytes(1));
  guard.watch(scan_bytes(2));
  const std::uint64_t third = guard.watch(scan_bytes(3));
  EXPECT_TRUE(guard.answer(third, scan_bytes(30)));
  EXPECT_EQ(sent.all(), (std::vector<int>{1, 2, 30}));
  EXPECT_EQ(guard.fired(), 2U);
}

TEST(Guard, SendsPendingScansAtShutdown) {
  Sent sent;
  {
    Guard guard(seconds(100), sent.publisher());
    guard.watch(scan_bytes(1));
    guard.watch(scan_bytes(2));
  }
  EXPECT_EQ(sent.all(), (std::vector<int>{1, 2}));
}

}  // namespace
}  // namespace parhelion::runtime
