// Lessons and scripts that an instructor begins by command.
#include <gmock/gmock.h>

#include "tests/server/tick/level_1.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using testing::HasSubstr;
using Action = AgentCommand::Action;

class LessonPath : public test::TickTest {
 protected:
  void wait(double until) {
    time_ = until;
    outputs_.clear();
    advance(configuration_, arrival(), *state_, outputs_, observer_);
    for (const Outputs::Entry& entry : outputs_.entries()) out_[entry.channel].push_back(entry.payload);
  }
  /// What the server answers: empty where it does so.
  std::string order(Action action, const std::string& name, double amount = 0, double lasting = 0) {
    time_ += 0.01;
    AgentCommand command;
    command.stamp = {arrival().ns};
    command.request = ++request_;
    command.action = action;
    command.agent.name = name;
    command.agent.T_map_base = Transform<Map, Base>::planar(amount, lasting, 0);
    feed(test::message(channel::mr_agent_cmd, arrival().utime(), command));
    for (const Event& event : decoded<Event>(channel::mr_events)) {
      if (event.request == request_ && event.kind == EventKind::command_accepted) return {};
      if (event.request == request_) return event.text;
    }
    return "no answer";
  }
  std::vector<Event> events(EventKind kind) {
    std::vector<Event> all = decoded<Event>(channel::mr_events);
    std::erase_if(all, [kind](const Event& event) { return event.kind != kind; });
    return all;
  }
  /// "+camera_delay 0.2" and "-camera_delay 0.2", in order.
  std::vector<std::string> said() {
    std::vector<std::string> all;
    for (const Event& event : decoded<Event>(channel::mr_events)) {
      const bool begun = event.kind == EventKind::lesson_started;
      if (!begun && event.kind != EventKind::lesson_ended) continue;
      const std::string what = event.text.empty() ? std::to_string(event.value).substr(0, 3) : event.text;
      all.push_back((begun ? "+" : "-") + event.object + " " + what);
    }
    return all;
  }
  ArrivalTime arrival() const { return ArrivalTime::from_utime(test::start_us) + seconds(time_); }

  double time_ = 0;
  std::uint64_t request_ = 0;
};

TEST_F(LessonPath, ALessonLastsAsLongAsItWasToldOrUntilItIsEnded) {
  start(test::level_1());
  EXPECT_EQ(order(Action::lesson, "camera_loss", 0.5, 1), "");
  EXPECT_EQ(order(Action::lesson, "camera_delay", 0.2), "");
  wait(0.5);
  EXPECT_THAT(said(), testing::ElementsAre("+camera_loss 0.5", "+camera_delay 0.2"));
  wait(2);
  EXPECT_THAT(said(), testing::ElementsAre("+camera_loss 0.5", "+camera_delay 0.2", "-camera_loss 0.5"));
  EXPECT_EQ(order(Action::lesson_over, "camera_delay"), "");
  wait(2.5);
  EXPECT_EQ(said().back(), "-camera_delay 0.2");
  EXPECT_THAT(order(Action::lesson_over, "camera_delay"), HasSubstr("not begun"));
}

TEST_F(LessonPath, BegunAgainItReplacesTheOneOfItsKind) {
  start(test::level_1());
  order(Action::lesson, "camera_delay", 0.2);
  wait(0.5);
  order(Action::lesson, "camera_delay", 0.4, 1);
  wait(1);
  EXPECT_THAT(said(), testing::ElementsAre("+camera_delay 0.2", "-camera_delay 0.2", "+camera_delay 0.4"));
  for (int i = 0; i < 1000; ++i) order(Action::lesson, "camera_delay", 0.1);
  EXPECT_LE(state_->faults.faults.size(), 4U) << "there is no end to what may be begun";
}

TEST_F(LessonPath, TheTwoSidesOfADriveDieApart) {
  start(test::level_1());
  order(Action::lesson, "dead_wheel", 0);
  order(Action::lesson, "dead_wheel", 1);
  wait(0.5);
  EXPECT_THAT(said(), testing::UnorderedElementsAre("+dead_wheel left", "+dead_wheel right"));
  order(Action::lesson_over, "dead_wheel");
  wait(1);
  EXPECT_EQ(said().size(), 4U);
}

TEST_F(LessonPath, ALessonThatIsEndedAtOnceIsOver) {
  start(test::level_1());
  EXPECT_EQ(order(Action::lesson, "camera_delay", 0.2), "");
  EXPECT_EQ(order(Action::lesson_over, "camera_delay"), "");
  wait(1);
  EXPECT_THAT(said(), testing::ElementsAre("+camera_delay 0.2", "-camera_delay 0.2"));
}

TEST_F(LessonPath, DropoutsThatAnInstructorBeginsTakeBeams) {
  start(test::level_1());
  wait(0.5);
  order(Action::lesson, "laser_dropouts", 1);
  wait(1.5);
  const auto scan = decoded<Scan>(channel::mr_scan).back();
  const auto& convention = configuration_.robot.laser->convention;
  for (const float range : scan.ranges) EXPECT_EQ(convention.classify(range), BeamKind::no_return);
}

TEST_F(LessonPath, WhatCannotBeIsRefusedWithAReason) {
  start(test::level_1());
  EXPECT_THAT(order(Action::lesson, "camera_dely", 0.1), HasSubstr("camera_delay"));
  EXPECT_THAT(order(Action::lesson, "camera_delay", 0.6), HasSubstr("0.5 s"));
  EXPECT_THAT(order(Action::lesson, "camera_loss", -0.1), HasSubstr("0 to 1"));
  EXPECT_THAT(order(Action::lesson, "camera_loss", 0.5, -3), HasSubstr("lasts"));
  EXPECT_THAT(order(Action::lesson, "low_battery", 0.5), HasSubstr("starts"));
  EXPECT_TRUE(state_->faults.faults.empty());
  start(test::configuration({}));
  EXPECT_THAT(order(Action::lesson, "dead_wheel", 0), HasSubstr("simulated"));
  EXPECT_THAT(order(Action::lesson, "laser_dropouts", 0.5), HasSubstr("simulated"));
  EXPECT_EQ(order(Action::lesson, "camera_delay", 0.1), "") << "that is of the page";
}

TEST_F(LessonPath, AScriptIsSetOffByNameAndDoesWhatItSays) {
  Scenario scenario;
  Script script;
  script.name = "a box falls from the shelf";
  script.when.kind = ScriptTrigger::Kind::time;
  script.when.time = 1000;
  script.actions.emplace_back();
  script.actions[0].action = Action::spawn;
  script.actions[0].agent = test::agent("box_1", AgentKind::box, 2, 1);
  scenario.scripts = {script};
  start(test::level_1({}, scenario));
  EXPECT_THAT(order(Action::script, "a box falls"), HasSubstr("a box falls from the shelf"));
  wait(0.5);
  EXPECT_FALSE(state_->simulation.pose_of("box_1"));
  EXPECT_EQ(order(Action::script, "a box falls from the shelf"), "");
  wait(1);
  EXPECT_TRUE(state_->simulation.pose_of("box_1"));
}

}  // namespace
}  // namespace parhelion::tick
