// A training whose clock waits: for a command, a motion, or the instructor.
#include "server/tick/start_path.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/tick/levels_fixture.hpp"

namespace parhelion::tick {
namespace {

using testing::HasSubstr;

/// One task that lasts 3 s, a person who walks up and down, a script after 1 s, a mine with a fuse of 2 s.
Configuration lesson(bool on_command = true) {
  Scenario scenario;
  Training& training = scenario.training.emplace();
  training.on_command = on_command;
  training.limit = 3;
  Task task;
  task.name = "far away";
  task.points = 10;
  task.done.kind = Condition::Kind::near;
  task.done.target = "walker";
  task.done.distance = 0.01;
  training.tasks.push_back(task);
  Script& script = scenario.scripts.emplace_back();
  script.name = "later";
  script.when.time = 1;
  script.actions.emplace_back(AgentFreeze{.agent = "walker", .frozen = false});
  Hazard& mine = scenario.hazards.emplace_back();
  mine.name = "mine";
  mine.delay = 2;
  AgentDefinition walker;
  walker.name = "walker";
  walker.kind = AgentKind::person;
  walker.T_map_base = Transform<Map, Base>::planar(1, 1.5, 0);
  walker.behaviour.kind = BehaviourKind::patrol;
  walker.behaviour.waypoints = {{1, 1.5}, {1, -1.5}};
  return test::level_1({walker}, scenario);
}

class StartTest : public test::LevelsTest {
 protected:
  Eigen::Vector3d walker() {
    const auto worlds = decoded<WorldMessage>(channel::kMrWorld);
    for (const WorldMessage::Entry& body : worlds.back().bodies)
      if (body.entity == "walker") return body.T_map_body.translation();
    ADD_FAILURE() << "no walker";
    return {};
  }
  void instruct_start() {
    const std::int64_t utime = test::teleop_at(time_, 0).arrival.utime();
    feed(test::message(channel::kMrStart, utime, TrainingStart{SensorTime::from_utime(utime), 7}));
    time_ += 0.05;
  }
};

TEST_F(StartTest, NothingRunsBeforeTheFirstCommandThatMoves) {
  start(lesson());
  run(0.2);
  const Eigen::Vector3d before = walker();
  run(6, Twist2{0, 0, 0});  // a console that holds its dead-man switch
  EXPECT_LT((walker() - before).norm(), 0.02) << "agents stand still";
  for (const EventKind kind :
       {EventKind::training_started, EventKind::script_started, EventKind::hazard_triggered,
        EventKind::task_started, EventKind::grading_ended})
    EXPECT_TRUE(events(kind).empty()) << to_string(kind);
  run(6.3, Twist2{0.2, 0, 0});
  const auto started = events(EventKind::training_started);
  ASSERT_EQ(started.size(), 1U);
  EXPECT_EQ(started[0].subject, "trainee");
  run(10, Twist2{0, 0, 0});
  EXPECT_GT((walker() - before).norm(), 0.3);
  const auto since = [&](EventKind kind) {
    const auto found = events(kind);
    return found.size() == 1 ? (found[0].stamp - started[0].stamp).seconds() : -1;
  };
  EXPECT_NEAR(since(EventKind::script_started), 1, 0.02) << "its time counts from the start";
  EXPECT_NEAR(since(EventKind::hazard_triggered), 2, 0.02);
  EXPECT_NEAR(since(EventKind::grading_ended), 3, 0.06);
}

TEST_F(StartTest, TheInstructorStartsItOnce) {
  start(lesson());
  run(2);
  instruct_start();
  ASSERT_EQ(events(EventKind::training_started).size(), 1U);
  EXPECT_EQ(events(EventKind::training_started)[0].subject, "");
  instruct_start();
  const auto refused = events(EventKind::command_refused);
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_THAT(refused[0].text, HasSubstr("no training is waiting for a start"));
  run(3, Twist2{0.2, 0, 0});
  EXPECT_EQ(events(EventKind::training_started).size(), 1U);
}

TEST_F(StartTest, WithTheSessionTheClockStartsAtOnce) {
  start(lesson(false));
  run(3.5);
  EXPECT_TRUE(events(EventKind::training_started).empty());
  EXPECT_EQ(events(EventKind::hazard_triggered).size(), 1U);
  EXPECT_EQ(events(EventKind::grading_ended).size(), 1U);
  instruct_start();
  EXPECT_EQ(events(EventKind::command_refused).size(), 1U);
}

TEST_F(StartTest, AnotherRobotsCommandStartsNothing) {
  start(lesson());
  const std::int64_t utime = test::teleop_at(0.5, 0).arrival.utime();
  feed(test::message("MR_AGENT_walker_TELEOP", utime,
                     TwistCommand{SensorTime::from_utime(utime), {0.3, 0, 0}}));
  EXPECT_TRUE(events(EventKind::training_started).empty());
}

}  // namespace
}  // namespace parhelion::tick
