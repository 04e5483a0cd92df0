// The same drive over and over: memory must stay flat. A minute of log time here, 24 hours with
// PARHELION_LONG=1.
#include <gtest/gtest.h>

#include <fstream>

#include "server/report.hpp"
#include "server/tick.hpp"
#include "tests/long_run.hpp"
#include "tests/server/synthetic.hpp"

namespace parhelion {
namespace {

/// Resident memory of this process, MB.
double resident() {
  std::ifstream statm("/proc/self/statm");
  double size = 0, pages = 0;
  statm >> size >> pages;
  return pages * 4096 / 1e6;
}

/// Shifts a message and what it says by `by`: the next lap.
template <class T>
void shift(Message& message, Duration by) {
  T item;
  ASSERT_TRUE(decode(message.channel, message.payload, item).ok());
  item.stamp = item.stamp + by;
  encode(item, message.payload);
}

TEST(Soak, MemoryStaysFlatOverManyLaps) {
  const bool whole_day = test::long_run();
  constexpr double lap = 40;  // s, one turn of the circle, so that laps join without a leap
  const int laps = whole_day ? 24 * 3600 / 40 : 8;
  const Configuration configuration =
      test::configuration({test::agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander),
                           test::agent("person_1", AgentKind::person, -3, 1, BehaviourKind::wander),
                           test::agent("box_1", AgentKind::box, 0, 0)});
  auto state = *make_state(configuration, ArrivalTime::from_utime(test::start_us - 2000));
  auto log = test::drive(lap);
  std::erase_if(log, [](const Message& m) { return m.channel == channel::robot; });
  Outputs outputs;
  StageClock early, late;
  double after_warm_up = 0;
  for (int i = 0; i < laps; ++i) {
    for (Message each : log) {
      const Duration by = seconds(lap * i);
      each.arrival = each.arrival + by;
      if (each.channel == channel::scan) shift<Scan>(each, by);
      if (each.channel == channel::odometry) shift<Odometry>(each, by);
      if (each.channel == channel::pose_cov) shift<PoseEstimate>(each, by);
      outputs.clear();
      StageClock& stages = i < laps / 2 ? early : late;
      stages.begin();
      tick(configuration, each, *state, outputs, stages);
    }
    if (i == laps / 4) after_warm_up = resident();
  }
  EXPECT_EQ(state->tally.scans_in, state->tally.scans_out);
  EXPECT_EQ(state->tally.scans_in, static_cast<std::uint64_t>(laps) * 400);
#ifndef __SANITIZE_ADDRESS__  // its quarantine keeps what was freed
  EXPECT_LT(resident(), after_warm_up + 4) << "MB";
#endif
  std::printf("scan p99: first half %.0f us, second half %.0f us; memory %.1f to %.1f MB\n",
              early.scan_us.at(0.99), late.scan_us.at(0.99), after_warm_up, resident());
}

}  // namespace
}  // namespace parhelion
