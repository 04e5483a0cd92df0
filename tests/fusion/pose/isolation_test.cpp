// What a child process may do to its parent: nothing.
#include "fusion/pose/isolation.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <vector>

namespace parhelion::pose {
namespace {

using Report = std::function<void(std::uint64_t)>;
constexpr ChildLimits kLimits{std::uint64_t{1} << 27U, 1};

TEST(Isolation, ReportsTheLastPlaceOfACrash) {
  const auto end = run_in_child(kLimits, [](const Report& report) {
    report(7);
    raise(SIGSEGV);
  });
  ASSERT_TRUE(end);
  EXPECT_FALSE(end->completed);
  EXPECT_FALSE(end->out_of_time);
  EXPECT_EQ(end->last, 7U);
}

TEST(Isolation, EndsAChildThatNeverEnds) {
  const auto end = run_in_child(kLimits, [](const Report&) {
    for (;;) getpid();
  });
  ASSERT_TRUE(end);
  EXPECT_FALSE(end->completed);
  EXPECT_TRUE(end->out_of_time);
}

TEST(Isolation, GivesAChildNoMoreMemoryThanItMayHave) {
  for (const std::size_t bytes : {std::size_t{1} << 20U, std::size_t{1} << 30U}) {
    const auto end = run_in_child(
        kLimits, [&](const Report& report) { report(std::vector<std::uint8_t>(bytes, 1).back()); });
    ASSERT_TRUE(end);
    EXPECT_EQ(end->completed, bytes < kLimits.bytes) << bytes;
  }
}

TEST(Isolation, AChildThatIsDoneHasCompleted) {
  const auto end = run_in_child(kLimits, [](const Report& report) { report(3); });
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->completed);
  EXPECT_EQ(end->last, 3U);
}

}  // namespace
}  // namespace parhelion::pose
