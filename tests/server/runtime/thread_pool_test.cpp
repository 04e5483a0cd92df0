#include "server/runtime/thread_pool.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace parhelion::runtime {
namespace {

TEST(ThreadPool, RunsEachJobOnceAndOnePerWorkerAtATime) {
  for (const int size : {1, 2, 8}) {
    ThreadPool pool(size);
    ASSERT_EQ(pool.size(), size);
    for (int round = 0; round < 50; ++round) {
      std::vector<std::atomic<int>> done(static_cast<std::size_t>(round));
      std::vector<std::atomic<int>> busy(static_cast<std::size_t>(size));
      pool.run(round, [&](int job, int worker) {
        EXPECT_EQ(busy[static_cast<std::size_t>(worker)]++, 0);
        ++done[static_cast<std::size_t>(job)];
        --busy[static_cast<std::size_t>(worker)];
      });
      for (const auto& count : done) ASSERT_EQ(count, 1);
    }
  }
}

TEST(ThreadPool, RethrowsExceptionsOfJobsAndContinues) {
  ThreadPool pool(3);
  const auto fail = [](int job, int) {
    if (job == 5) throw std::runtime_error("five");
  };
  EXPECT_THROW(pool.run(20, fail), std::runtime_error);
  std::atomic<int> sum = 0;
  pool.run(20, [&](int job, int) { sum += job; });
  EXPECT_EQ(sum, 190);
}

}  // namespace
}  // namespace parhelion::runtime
