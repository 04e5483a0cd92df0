// The real robot's arm lifts virtual things into a container, by script and without a network.
#include "tests/loop/lift.hpp"

#include <gtest/gtest.h>

namespace parhelion::test {
namespace {

class Lift : public ::testing::TestWithParam<LiftBy> {};

TEST_P(Lift, DrawnThingsAreLiftedIntoTheContainerWithTheEventsInTime) {
  for (std::uint64_t seed = 201; seed < 206; ++seed) {
    const LiftReport report = lift_and_place(seed, GetParam());
    for (const std::string& failure : report.failures)
      ADD_FAILURE() << "seed " << seed << ", " << report.thing << ": " << failure;
    EXPECT_EQ(report.live.score, 100) << seed;
  }
}

TEST_P(Lift, HasTheSameBytesForAnyThreadCount) {
  const LiftReport report = lift_and_place(203, GetParam());
  for (const int threads : {2, 8})
    EXPECT_TRUE(lift_again(203, GetParam(), report, threads) == report.outputs) << threads;
}

INSTANTIATE_TEST_SUITE_P(Arrangements, Lift, ::testing::Values(LiftBy::trainee, LiftBy::robot),
                         [](const auto& param) {
                           return param.param == LiftBy::trainee ? "trainee" : "robot";
                         });

}  // namespace
}  // namespace parhelion::test
