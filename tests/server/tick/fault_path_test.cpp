// Faults and scripts started by an instructor's command.
#include <gmock/gmock.h>

#include "tests/server/tick/level_1.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using testing::HasSubstr;
using Kind = Fault::Kind;

class FaultPath : public test::TickTest {
 protected:
  void wait(double until) {
    time_ = until;
    advance_to(arrival());
  }
  /// The server's refusal; empty if it accepts.
  std::string order(InstructorCommand command) {
    time_ += 0.01;
    set_request(command, {arrival().ns}, ++request_);
    feed(test::message(channel_of(command), arrival().utime(), command));
    for (const Event& event : decoded<Event>(channel::kMrEvents)) {
      if (event.request == request_ && event.kind == EventKind::command_accepted) return {};
      if (event.request == request_) return event.text;
    }
    return "no answer";
  }
  std::string begin(Kind kind, double amount, std::optional<double> duration = {}) {
    return order(FaultCommand{.kind = kind, .amount = amount, .duration = duration});
  }
  std::string kill_wheel(bool right) { return order(FaultCommand{.kind = Kind::dead_wheel, .right = right}); }
  std::string end(Kind kind) { return order(FaultCommand{.kind = kind, .begins = false}); }
  std::vector<Event> events(EventKind kind) {
    std::vector<Event> all = decoded<Event>(channel::kMrEvents);
    std::erase_if(all, [kind](const Event& event) { return event.kind != kind; });
    return all;
  }
  /// "+camera_delay 0.2" and "-camera_delay 0.2", in order.
  std::vector<std::string> fault_events() {
    std::vector<std::string> all;
    for (const Event& event : decoded<Event>(channel::kMrEvents)) {
      const bool begun = event.kind == EventKind::fault_started;
      if (!begun && event.kind != EventKind::fault_ended) continue;
      const std::string what = event.text.empty() ? std::to_string(event.value).substr(0, 3) : event.text;
      all.push_back((begun ? "+" : "-") + event.object + " " + what);
    }
    return all;
  }
  ArrivalTime arrival() const { return ArrivalTime::from_utime(test::kStartUs) + seconds(time_); }

  double time_ = 0;
  std::uint64_t request_ = 0;
};

TEST_F(FaultPath, AFaultLastsForItsDurationOrUntilEnded) {
  start(test::level_1());
  EXPECT_EQ(begin(Kind::camera_loss, 0.5, 1), "");
  EXPECT_EQ(begin(Kind::camera_delay, 0.2), "");
  wait(0.5);
  EXPECT_THAT(fault_events(), testing::ElementsAre("+camera_loss 0.5", "+camera_delay 0.2"));
  wait(2);
  EXPECT_THAT(fault_events(),
              testing::ElementsAre("+camera_loss 0.5", "+camera_delay 0.2", "-camera_loss 0.5"));
  EXPECT_EQ(end(Kind::camera_delay), "");
  wait(2.5);
  EXPECT_EQ(fault_events().back(), "-camera_delay 0.2");
  EXPECT_THAT(end(Kind::camera_delay), HasSubstr("not active"));
}

TEST_F(FaultPath, ARepeatedFaultReplacesTheOneOfItsKind) {
  start(test::level_1());
  begin(Kind::camera_delay, 0.2);
  wait(0.5);
  begin(Kind::camera_delay, 0.4, 1);
  wait(1);
  EXPECT_THAT(fault_events(),
              testing::ElementsAre("+camera_delay 0.2", "-camera_delay 0.2", "+camera_delay 0.4"));
  for (int i = 0; i < 1000; ++i) begin(Kind::camera_delay, 0.1);
  EXPECT_LE(state_->faults.faults.size(), 4U) << "there is no end to what may be begun";
}

TEST_F(FaultPath, TheTwoDriveSidesFailIndependently) {
  start(test::level_1());
  kill_wheel(false);
  kill_wheel(true);
  wait(0.5);
  EXPECT_THAT(fault_events(), testing::UnorderedElementsAre("+dead_wheel left", "+dead_wheel right"));
  end(Kind::dead_wheel);
  wait(1);
  EXPECT_EQ(fault_events().size(), 4U);
}

TEST_F(FaultPath, AFaultEndedAtOnceIsInactive) {
  start(test::level_1());
  EXPECT_EQ(begin(Kind::camera_delay, 0.2), "");
  EXPECT_EQ(end(Kind::camera_delay), "");
  wait(1);
  EXPECT_THAT(fault_events(), testing::ElementsAre("+camera_delay 0.2", "-camera_delay 0.2"));
}

TEST_F(FaultPath, DropoutsStartedByAnInstructorRemoveBeams) {
  start(test::level_1());
  wait(0.5);
  begin(Kind::laser_dropouts, 1);
  wait(1.5);
  const auto scan = decoded<Scan>(channel::kMrScan).back();
  const auto& convention = configuration_.robot.laser->convention;
  for (const float range : scan.ranges) EXPECT_EQ(convention.classify(range), BeamKind::no_return);
}

TEST_F(FaultPath, InvalidFaultsAreRefusedWithAReason) {
  start(test::level_1());
  EXPECT_THAT(begin(Kind::camera_delay, 0.6), HasSubstr("0.5 s"));
  EXPECT_THAT(begin(Kind::camera_loss, -0.1), HasSubstr("0 to 1"));
  EXPECT_THAT(begin(Kind::camera_loss, 0.5, -3), HasSubstr("duration: -3"));
  EXPECT_THAT(begin(Kind::low_battery, 0.5), HasSubstr("starts"));
  EXPECT_TRUE(state_->faults.faults.empty());
  start(test::configuration({}));
  EXPECT_THAT(kill_wheel(false), HasSubstr("simulated"));
  EXPECT_THAT(begin(Kind::laser_dropouts, 0.5), HasSubstr("simulated"));
  EXPECT_EQ(begin(Kind::camera_delay, 0.1), "") << "that is of the page";
}

TEST_F(FaultPath, AScriptStartsByNameAndRunsItsActions) {
  Scenario scenario;
  Script script;
  script.name = "a box falls from the shelf";
  script.when.kind = ScriptTrigger::Kind::time;
  script.when.time = 1000;
  script.actions = {AgentSpawn{.agent = test::agent("box_1", AgentKind::box, 2, 1)}};
  scenario.scripts = {script};
  start(test::level_1({}, scenario));
  EXPECT_THAT(order(ScriptStart{.script = "a box falls"}), HasSubstr("a box falls from the shelf"));
  wait(0.5);
  EXPECT_FALSE(state_->simulation.pose_of("box_1"));
  EXPECT_EQ(order(ScriptStart{.script = "a box falls from the shelf"}), "");
  wait(1);
  EXPECT_TRUE(state_->simulation.pose_of("box_1"));
}

}  // namespace
}  // namespace parhelion::tick
