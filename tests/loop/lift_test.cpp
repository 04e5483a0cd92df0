#include "tests/loop/lift.hpp"

#include <gtest/gtest.h>

#include <cstdio>

namespace parhelion::test {
namespace {

void expect_as_it_must_be(const LiftReport& report) {
  for (const std::string& failure : report.failures) ADD_FAILURE() << report.thing << ": " << failure;
  std::printf("%s: %s, events within %.0f ms, score %.0f\n", report.thing.c_str(), report.phase.c_str(),
              1e3 * report.worst_delay, report.live.score);
}

/// Seeds that nothing was chosen on; 1 to 8 were.
class LiftAndPlace : public ::testing::TestWithParam<int> {};

TEST_P(LiftAndPlace, IsReportedAtTheRightStepAndGradedTheSameFromTheLog) {
  const auto seed = static_cast<std::uint64_t>(GetParam());
  expect_as_it_must_be(lift_and_place(seed, seed % 2 == 0 ? LiftBy::trainee : LiftBy::robot));
}

INSTANTIATE_TEST_SUITE_P(Seeds, LiftAndPlace, ::testing::Range(201, 221));

TEST(LiftAndPlaceAgain, GivesTheSameBytesWithAnyNumberOfThreads) {
  for (const LiftBy by : {LiftBy::trainee, LiftBy::robot}) {
    const LiftReport report = lift_and_place(221, by);
    expect_as_it_must_be(report);
    for (const int threads : {1, 2, 8}) EXPECT_TRUE(report.outputs == lift_again(221, by, report, threads));
  }
}

}  // namespace
}  // namespace parhelion::test
