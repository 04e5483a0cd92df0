// A laser whose beams are described in the wrong order: the server notices it in turns, says so, and from
// then on shows virtual objects as if they had been described rightly.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/fusion/pose/swept_drive.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

constexpr double kInterval = 0.09 / 361;   // s between two beams: a laser that turns ten times a second
constexpr std::int64_t kSweepUs = 91'000;  // a scan arrives after its last beam

class BeamWatchTest : public test::TickTest {
 protected:
  /// A drive past two boxes; odometry arrives at once, SLAM's pose, the true one, just after its scan.
  void drive(double described, double real) {
    test::SweptDrive driven = test::swept_drive(31, described, real);
    driven.robot.footprint = test::robot().footprint;
    Scenario scenario;
    scenario.agents = {test::agent("box_1", AgentKind::box, 8, 2),
                       test::agent("box_2", AgentKind::box, 10.8, 5)};
    out_.clear();
    auto configured = configure(scenario, driven.robot, {});
    ASSERT_TRUE(configured.ok()) << configured.error().message;
    configuration_ = std::move(*configured);
    auto made = make_state(configuration_, ArrivalTime::from_utime(999'900'000));
    ASSERT_TRUE(made.ok()) << made.error().message;
    state_ = std::move(*made);
    std::vector<Message> log;
    std::size_t scans = 0;
    for (const test::DriveInput& input : driven.inputs) {
      if (!input.scan) {
        log.push_back(test::message(channel::kOdometry, input.odometry.stamp.utime() + 1, input.odometry));
        continue;
      }
      const std::int64_t arrival = input.scan->stamp.utime() + kSweepUs;
      log.push_back(test::message(channel::kScan, arrival, *input.scan));
      PoseEstimate estimate;
      estimate.stamp = input.scan->stamp;
      estimate.T_map_base = transform<Map, Base>(driven.truth[scans++]);
      estimate.covariance = PoseCovariance::Identity() * 1e-5;
      estimate.state = SlamState::tracking;
      log.push_back(test::message(channel::kPoseCov, arrival + 1, estimate));
    }
    std::stable_sort(log.begin(), log.end(),
                     [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
    feed(log);
  }
  std::vector<Event> conflicts() {
    std::vector<Event> all = decoded<Event>(channel::kMrEvents);
    std::erase_if(all, [](const Event& event) { return event.kind != EventKind::scans_conflict; });
    return all;
  }
  std::vector<Scan> shown() { return decoded<Scan>(channel::kMrScan); }
};

TEST_F(BeamWatchTest, ShowsObjectsInTheTrueOrderOnceItIsKnown) {
  ASSERT_NO_FATAL_FAILURE(drive(-kInterval, -kInterval));
  EXPECT_THAT(conflicts(), testing::IsEmpty()) << "described rightly";
  const std::vector<Scan> right = shown();
  ASSERT_NO_FATAL_FAILURE(drive(kInterval, -kInterval));
  const std::vector<Event> conflict = conflicts();
  ASSERT_EQ(conflict.size(), 1U);
  EXPECT_THAT(conflict[0].text,
              testing::AllOf(testing::HasSubstr("SCAN: the laser measures"),
                             testing::HasSubstr("beam_interval"), testing::HasSubstr("-0.00024")));
  const std::vector<Scan> corrected = shown();
  ASSERT_EQ(corrected.size(), right.size());
  std::size_t bent = 0, bent_later = 0, later = 0;
  for (std::size_t i = 0; i < right.size(); ++i) {
    const bool differs = corrected[i].ranges != right[i].ranges;
    const bool after = corrected[i].stamp.ns + kSweepUs * 1000 > conflict[0].stamp.ns;
    bent += differs ? 1 : 0;
    later += after ? 1 : 0;
    bent_later += differs && after ? 1 : 0;
  }
  EXPECT_GT(bent, 3U) << "before it was known";
  EXPECT_GT(later, 50U);
  EXPECT_EQ(bent_later, 0U);
}

}  // namespace
}  // namespace parhelion::tick
