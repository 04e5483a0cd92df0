// What a child process may do to its parent: nothing.
#include "protocols/isolation.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

namespace parhelion {
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
#ifdef PARHELION_ADDRESS_SANITIZER
  GTEST_SKIP() << "memory is not limited under this sanitizer";
#endif
  for (const std::size_t bytes : {std::size_t{1} << 20U, std::size_t{1} << 30U}) {
    const auto end = run_in_child(
        kLimits, [&](const Report& report) { report(std::vector<std::uint8_t>(bytes, 1).back()); });
    ASSERT_TRUE(end);
    EXPECT_EQ(end->completed, bytes < kLimits.bytes) << bytes;
  }
}

TEST(Isolation, ReturnsTheBytesOfEachOfManyChildren) {
  const auto bytes = [](std::size_t i) { return std::string(40'000 * i, static_cast<char>(i)); };
  for (const std::size_t at_once : {0U, 1U, 3U, 40U}) {
    std::vector<int> times(20);
    results_of_children(
        times.size(), at_once,
        [&](std::size_t i) {
          return ChildTask{kLimits, [&, i](const Report& report) {
                             report(i);
                             if (i == 7) raise(SIGSEGV);
                             return bytes(i);
                           }};
        },
        [&](std::size_t i, const Result<ChildResult>& result) {
          ++times[i];
          ASSERT_TRUE(result);
          EXPECT_EQ(result->end.completed, i != 7);
          EXPECT_EQ(result->bytes, i == 7 ? "" : bytes(i));
          EXPECT_EQ(result->end.last, i);
        });
    EXPECT_EQ(times, std::vector<int>(20, 1)) << at_once;
  }
}

TEST(Isolation, GivesReportsAndResultApart) {
  std::vector<std::uint64_t> reports;
  const auto result = result_of_child(
      kLimits,
      [](const Report& report) {
        for (std::uint64_t i = 0; i < 5; ++i) report(i);
        return std::string("five");
      },
      [&](std::uint64_t report) { reports.push_back(report); });
  ASSERT_TRUE(result);
  EXPECT_EQ(reports, (std::vector<std::uint64_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(result->bytes, "five");
  EXPECT_EQ(result->end.last, 4U);
}

TEST(Isolation, DescribesWhyAChildDied) {
  const auto reason = [](const std::function<std::string()>& work) {
    const auto result = result_of_child(kLimits, [&](const Report&) { return work(); });
    EXPECT_EQ(result->bytes, "");
    return describe(result->end, kLimits);
  };
  EXPECT_EQ(reason([]() -> std::string { abort(); }), "crashed (Aborted)");
  EXPECT_EQ(reason([]() -> std::string { throw std::bad_alloc(); }), "needs more than 128 MB");
  EXPECT_EQ(reason([]() -> std::string { throw std::runtime_error("no"); }),
            "ended with an unexpected error");
}

TEST(Isolation, AChildThatIsDoneHasCompleted) {
  const auto end = run_in_child(kLimits, [](const Report& report) { report(3); });
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->completed);
  EXPECT_EQ(end->last, 3U);
}

}  // namespace
}  // namespace parhelion
