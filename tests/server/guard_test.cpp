#include "server/guard.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>

#include "server/wall_clock.hpp"

namespace parhelion {
namespace {

std::vector<std::uint8_t> scan_bytes(std::uint8_t first) { return {first, 2, 3}; }

/// Waits for what the guard sends.
class Sent {
 public:
  Guard::Publish publisher() {
    return [this](std::span<const std::uint8_t> raw) {
      const std::lock_guard lock(mutex_);
      ++counts_[raw[0]];
      ++total_;
      changed_.notify_all();
    };
  }
  bool wait_for(int total) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(20), [&] { return total_ >= total; });
  }
  std::map<int, int> counts() {
    const std::lock_guard lock(mutex_);
    return counts_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<int, int> counts_;
  int total_ = 0;
};

TEST(Guard, SendsTheRawScanWhereTheLoopIsSilent) {
  Sent sent;
  Guard guard(milliseconds(5), sent.publisher());
  const std::uint64_t ticket = guard.watch(scan_bytes(7));
  ASSERT_TRUE(sent.wait_for(1));
  EXPECT_FALSE(guard.claim(ticket)) << "the loop must not answer as well";
  EXPECT_EQ(guard.fired(), 1U);
}

TEST(Guard, KeepsStillWhereTheLoopWasFirst) {
  Sent sent;
  {
    Guard guard(milliseconds(1), sent.publisher());
    std::vector<std::uint64_t> late;
    for (int i = 0; i < 200; ++i) {
      const std::uint64_t ticket = guard.watch(scan_bytes(1));
      if (!guard.claim(ticket)) late.push_back(ticket);
    }
    const std::uint64_t last = guard.watch(scan_bytes(2));
    ASSERT_TRUE(sent.wait_for(static_cast<int>(late.size()) + 1));
    EXPECT_FALSE(guard.claim(last));
    EXPECT_EQ(guard.fired(), late.size() + 1);
  }
}

TEST(Guard, AnswersEachScanExactlyOnceHoweverTheThreadsRace) {
  Sent sent;
  int answered_by_loop = 0;
  constexpr int scans = 400;
  {
    Guard guard(microseconds(200), sent.publisher());
    for (int i = 0; i < scans; ++i) {
      const std::uint64_t ticket = guard.watch(scan_bytes(1));
      const WallTime until = steady_now() + microseconds(i % 2 == 0 ? 150 : 260);
      while (steady_now() < until) {
      }
      if (guard.claim(ticket)) ++answered_by_loop;
    }
    ASSERT_TRUE(sent.wait_for(scans - answered_by_loop));
  }
  EXPECT_EQ(sent.counts()[1] + answered_by_loop, scans);
}

}  // namespace
}  // namespace parhelion
