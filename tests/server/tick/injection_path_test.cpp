// Events tell the grader from the start whether the trainee could see virtual agents.
#include <gtest/gtest.h>

#include "server/tick/grading_path.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using test::agent;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                kInfinity = std::numeric_limits<float>::infinity();

/// The robot stands at (1.5, 0), with the messages of test::drive().
class InjectionPath : public test::TickTest {
 protected:
  void start_beside_a_person() {
    Scenario scenario;
    scenario.agents = {agent("person_1", AgentKind::person, 2.6, 0)};
    Training& training = scenario.training.emplace();
    training.on_command = false;
    Task task;
    task.name = "stay";
    task.points = 10;
    task.done.kind = Condition::Kind::still;
    task.done.duration = 60;
    Penalty near;
    near.name = "near";
    near.points = 3;
    near.when.kind = Condition::Kind::near;
    near.when.target = "person_1";
    near.when.distance = 2;
    training.tasks = {task};
    training.penalties = {near};
    auto made = configure(scenario, test::robot(), test::room());
    ASSERT_TRUE(made.ok()) << made.error().message;
    start(std::move(*made));
  }
  /// From `from` to `to` (s); sigma of the pose (m).
  void stand(double from, double to, bool scans, double sigma) {
    for (int i = 0; from + i * 0.05 < to; ++i) {
      const double t = from + i * 0.05;
      const std::int64_t utime = test::kStartUs + std::llround(t * 1e6);
      feed(test::message(channel::kOdometry, utime + 2000,
                         Odometry{SensorTime::from_utime(utime), test::pose_at(0).as<Odom, Base>()}));
      if (i % 2 != 0) continue;
      Scan scan = test::scan_at(0);
      scan.stamp = SensorTime::from_utime(utime);
      if (all_ranges) std::fill(scan.ranges.begin(), scan.ranges.end(), *all_ranges);
      if (scans) feed(test::message(channel::kScan, utime + 5000, scan));
      PoseEstimate estimate;
      estimate.stamp = scan.stamp;
      estimate.T_map_base = test::pose_at(0);
      estimate.covariance = PoseCovariance::Identity() * sigma * sigma;
      estimate.covariance(5, 5) = 1e-6;
      estimate.map_id = "synthetic";
      estimate.state = SlamState::tracking;
      feed(test::message(channel::kPoseCov, utime + 25000, estimate));
    }
  }
  std::optional<float> all_ranges;  ///< m, of all beams from now on
  std::size_t deductions() const { return state_->grading->graders.front().deductions().size(); }
  std::vector<Event> events(EventKind kind) {
    std::vector<Event> all = decoded<Event>(channel::kMrEvents);
    std::erase_if(all, [kind](const Event& event) { return event.kind != kind; });
    return all;
  }
};

TEST_F(InjectionPath, WithoutScansInjectionIsSuspendedFromTheStart) {
  start_beside_a_person();
  stand(0, 2, false, 0.01);
  EXPECT_EQ(deductions(), 0U);
  ASSERT_EQ(events(EventKind::injection_suspended).size(), 1U);
  EXPECT_EQ(events(EventKind::injection_suspended)[0].text, "no scan yet");
  EXPECT_TRUE(events(EventKind::injection_active).empty());
  stand(2, 3, true, 0.01);
  EXPECT_EQ(events(EventKind::injection_active).size(), 1U);
  EXPECT_EQ(deductions(), 1U) << "now it can be seen";
}

TEST_F(InjectionPath, AnAgentHiddenFromTheFirstScanIsNotNear) {
  start_beside_a_person();
  stand(0, 2, true, 0.5);
  EXPECT_EQ(deductions(), 0U);
  EXPECT_TRUE(events(EventKind::injection_active).empty());
  ASSERT_EQ(events(EventKind::agent_hidden).size(), 1U);
  EXPECT_EQ(events(EventKind::agent_hidden)[0].object, "person_1");
  stand(2, 3, true, 0.01);
  ASSERT_EQ(events(EventKind::agent_shown).size(), 1U);
  EXPECT_EQ(events(EventKind::agent_shown)[0].object, "person_1");
  EXPECT_EQ(deductions(), 1U);
}

TEST_F(InjectionPath, ReportsWhenScansStopAndWhenTheyReturn) {
  start_beside_a_person();
  stand(0, 1, true, 0.01);
  const std::size_t degraded = events(EventKind::injection_suspended).size();
  ASSERT_EQ(deductions(), 1U);
  stand(1, 3, false, 0.01);
  ASSERT_EQ(events(EventKind::injection_suspended).size(), degraded + 1);
  EXPECT_EQ(events(EventKind::injection_suspended).back().text, "no scan for 0.5 s");
  const std::size_t restored = events(EventKind::injection_active).size();
  stand(3, 4, true, 0.01);
  EXPECT_EQ(events(EventKind::injection_active).size(), restored + 1);
  EXPECT_EQ(deductions(), 2U) << "it came into sight anew";
}

// A covered or broken laser looks healthy by its rate alone.
TEST_F(InjectionPath, ScansWithoutAValidBeamSuspendInjection) {
  for (const float range : {kNan, -1.F, -kInfinity}) {
    out_.clear();
    all_ranges.reset();
    start_beside_a_person();
    stand(0, 1, true, 0.01);
    ASSERT_TRUE(events(EventKind::injection_suspended).size() <= 1);
    const std::size_t before = events(EventKind::injection_suspended).size();
    const std::size_t active = events(EventKind::injection_active).size();
    all_ranges = range;
    stand(1, 2, true, 0.01);
    ASSERT_EQ(events(EventKind::injection_suspended).size(), before + 1) << range;
    EXPECT_TRUE(events(EventKind::injection_suspended).back().text.starts_with("no valid beam")) << range;
    const ScanInfo info = decoded<ScanInfo>(channel::kMrScanInfo).back();
    EXPECT_FALSE(info.live) << range;
    EXPECT_TRUE(info.reason.starts_with("no valid beam")) << info.reason;
    EXPECT_GT(state_->tally.scans_degraded[static_cast<std::size_t>(Degraded::no_beam)], 5U);
    all_ranges.reset();
    stand(2, 3, true, 0.01);
    EXPECT_EQ(events(EventKind::injection_active).size(), active + 1) << range;
    EXPECT_TRUE(decoded<ScanInfo>(channel::kMrScanInfo).back().live) << range;
  }
}

TEST_F(InjectionPath, ScansOfAnEmptyHallAreValid) {
  start_beside_a_person();
  stand(0, 1, true, 0.01);
  all_ranges = test::robot().laser->convention.no_return_sentinel();
  const std::size_t before = events(EventKind::injection_suspended).size();
  stand(1, 2, true, 0.01);
  EXPECT_EQ(events(EventKind::injection_suspended).size(), before);
  EXPECT_TRUE(decoded<ScanInfo>(channel::kMrScanInfo).back().live);
}

}  // namespace
}  // namespace parhelion::tick
