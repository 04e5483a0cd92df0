// A session log is graded by what it holds.
#include "server/grade_session.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "server/replay.hpp"
#include "tests/server/synthetic.hpp"

namespace parhelion {
namespace {

using test::agent;
using testing::HasSubstr;

Condition on(EventKind kind, const std::string& object) {
  Condition condition;
  condition.event = kind;
  condition.object = object;
  return condition;
}

/// The synthetic drive, with a barrel put in its way, as a session log.
class GradeSession : public testing::Test {
 protected:
  std::string record(const std::string& name, const std::function<void(Scenario&)>& change = {}) {
    Scenario scenario;
    scenario.name = "lesson";
    scenario.model = folder_ / "model.yaml";
    const Eigen::Vector2d ahead = test::pose_at(4).translation().head<2>();
    scenario.agents = {agent("barrel_1", AgentKind::barrel, ahead.x(), ahead.y())};
    const Eigen::Vector2d p = test::pose_at(1.5).translation().head<2>();
    Zone zone;
    zone.name = "hall";
    zone.outline = {{p.x() - 0.2, p.y() - 0.2},
                    {p.x() + 0.2, p.y() - 0.2},
                    {p.x() + 0.2, p.y() + 0.2},
                    {p.x() - 0.2, p.y() + 0.2}};
    scenario.zones = {zone};
    Training& training = scenario.training.emplace();
    Task hall;
    hall.name = "into the hall";
    hall.points = 50;
    hall.done.kind = Condition::Kind::reach;
    hall.done.target = "hall";
    training.tasks = {hall};
    Task never;
    never.name = "never";
    never.points = 50;
    never.done = on(EventKind::fell, "");
    training.tasks.push_back(never);
    Penalty touch;
    touch.name = "touched a virtual thing";
    touch.points = 7;
    touch.when = on(EventKind::collision_started, "barrel_1");
    training.penalties = {touch};
    if (change) change(scenario);
    std::ofstream(folder_ / "model.yaml") << to_yaml(test::room());
    std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
    test::write_log(folder_ / "drive.lcm", test::drive(6));
    ReplayOptions options;
    options.log = folder_ / "drive.lcm";
    options.scenario = folder_ / "scenario.yaml";
    options.session = folder_ / name;
    const auto report = replay(options);
    error_ = report ? "" : report.error().message;
    return options.session;
  }
  test::Folder folder_;
  std::string error_;
};

TEST_F(GradeSession, TheTraineeIsPenalizedForTouchingAVirtualBarrel) {
  const auto session = grade_session(record("a.lcm"));
  ASSERT_TRUE(session.ok()) << session.error().message;
  const Grade& grade = session->grade;
  EXPECT_EQ(grade.tasks[0].outcome, TaskOutcome::done);
  EXPECT_EQ(grade.tasks[0].cause->kind, EventKind::zone_entered);
  EXPECT_EQ(grade.tasks[1].outcome, TaskOutcome::open);
  ASSERT_FALSE(grade.charges.empty()) << to_text(*session);
  EXPECT_EQ(grade.charges[0].cause->object, "barrel_1");
  EXPECT_EQ(grade.charges[0].cause->pair, PairKind::real_virtual);
  EXPECT_EQ(grade.score, 50 - 7.0 * static_cast<double>(grade.charges.size()));
  EXPECT_THAT(to_text(*session), HasSubstr("touched a virtual thing  collision_started"));
}

TEST_F(GradeSession, TheSessionReplayedHasTheSameGradeToTheBit) {
  const std::string first = record("a.lcm");
  ReplayOptions again;
  again.log = first;
  again.session = folder_ / "b.lcm";
  again.threads = 2;
  ASSERT_TRUE(replay(again).ok());
  auto a = grade_session(first), b = grade_session(again.session);
  ASSERT_TRUE(a.ok() && b.ok());
  b->log = a->log;
  EXPECT_EQ(to_json(*a), to_json(*b));
}

TEST_F(GradeSession, ALogThatIsCutOffIsGradedAsFarAsItGoes) {
  const std::string path = record("a.lcm");
  std::filesystem::resize_file(path, std::filesystem::file_size(path) * 2 / 3 + 5);
  const auto session = grade_session(path);
  ASSERT_TRUE(session.ok()) << session.error().message;
  EXPECT_FALSE(session->grade.complete);
  EXPECT_EQ(session->grade.tasks[0].outcome, TaskOutcome::done);
  EXPECT_THAT(to_text(*session), HasSubstr("INCOMPLETE"));
}

TEST_F(GradeSession, WhatCannotBeGradedSaysWhy) {
  test::write_log(folder_ / "bare.lcm", test::drive(1));
  EXPECT_THAT(grade_session(folder_ / "bare.lcm").error().message, HasSubstr("no MR_SESSION in it"));
  const std::string path = record("none.lcm", [](Scenario& scenario) { scenario.training.reset(); });
  EXPECT_THAT(grade_session(path).error().message, HasSubstr("nothing to grade"));
  EXPECT_FALSE(grade_session(folder_ / "missing.lcm").ok());
}

TEST_F(GradeSession, ATrainingThatNamesWhatIsNotThereIsRefusedBeforeTheStart) {
  record("a.lcm", [](Scenario& scenario) { scenario.training->tasks[0].done.target = "hal"; });
  EXPECT_THAT(error_, HasSubstr("task 'into the hall': there is no zone 'hal', did you mean 'hall'?"));
  record("b.lcm", [](Scenario& scenario) {
    scenario.training->tasks[0].done.kind = Condition::Kind::pass;
    scenario.training->tasks[0].done.target = "door 9";
  });
  EXPECT_THAT(error_, HasSubstr("there is no door 'door 9'"));
  record("c.lcm", [](Scenario& scenario) { scenario.training->robot = "rover_7"; });
  EXPECT_THAT(error_, HasSubstr("no robot 'rover_7'"));
}

}  // namespace
}  // namespace parhelion
