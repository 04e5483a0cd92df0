// The scan path does not allocate after warm-up.
#include <gtest/gtest.h>

#include "server/tick/tick.hpp"
#include "tests/allocations.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::tick {
namespace {

TEST(ScanPath, AllocatesNothingAfterWarmUp) {
  const Configuration configuration = test::configuration({test::agent("box_1", AgentKind::box, 3, 2),
                                                           test::agent("barrel_1", AgentKind::barrel, 3, -2),
                                                           test::agent("robot_1", AgentKind::robot, 0, 0)});
  auto state = *make_state(configuration, ArrivalTime::from_utime(test::kStartUs - 2000));
  Outputs outputs;
  StageObserver observer;
  std::size_t warm_scans = 0;
  for (const Message& each : test::drive(60)) {
    outputs.clear();
    if (each.channel != channel::kScan || each.arrival.utime() < test::kStartUs + 45'000'000) {
      tick(configuration, each, *state, outputs, observer);
      continue;
    }
    advance(configuration, each.arrival, *state, outputs, observer);
    const test::AllocationWatch watch;
    tick(configuration, each, *state, outputs, observer);
    ASSERT_EQ(watch.count(), 0U) << "scan " << warm_scans;
    ++warm_scans;
  }
  EXPECT_EQ(warm_scans, 150U);
  EXPECT_GT(state->tally.beams_replaced, 0U);
}

}  // namespace
}  // namespace parhelion::tick
