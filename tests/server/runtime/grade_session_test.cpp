// A session log is graded by its contents only.
#include "server/runtime/grade_session.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "server/runtime/replay.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::runtime {
namespace {

using test::agent;
using testing::HasSubstr;

Condition on(EventKind kind, const std::string& object) {
  Condition condition;
  condition.event = kind;
  condition.object = object;
  return condition;
}

/// The synthetic drive, with a barrel on its path, as a session log.
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
    training.on_command = false;
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
    touch.when = on(EventKind::contact_started, "barrel_1");
    training.penalties = {touch};
    if (change) change(scenario);
    std::ofstream(folder_ / "model.yaml") << to_yaml(test::room());
    std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
    test::write_log(folder_ / "drive.lcm", drive_);
    ReplayOptions options;
    options.log = folder_ / "drive.lcm";
    options.scenario = folder_ / "scenario.yaml";
    options.session = folder_ / name;
    const auto report = replay(options);
    error_ = report ? "" : report.error().message;
    report_ = report ? std::optional(*report) : std::nullopt;
    return options.session;
  }
  test::TemporaryFolder folder_;
  std::vector<Message> drive_ = test::drive(6);
  std::string error_;
  std::optional<Report> report_;
};

TEST_F(GradeSession, TheTraineeIsPenalizedForTouchingAVirtualBarrel) {
  const auto session = grade_session(record("a.lcm"));
  ASSERT_TRUE(session.ok()) << session.error().message;
  const training::Grade& grade = session->grade;
  EXPECT_EQ(grade.tasks[0].outcome, training::TaskOutcome::done);
  EXPECT_EQ(grade.tasks[0].cause->kind, EventKind::zone_entered);
  EXPECT_EQ(grade.tasks[1].outcome, training::TaskOutcome::open);
  ASSERT_FALSE(grade.deductions.empty()) << to_text(*session);
  EXPECT_EQ(grade.deductions[0].cause->object, "barrel_1");
  EXPECT_EQ(grade.deductions[0].cause->pair, PairKind::real_virtual);
  EXPECT_EQ(grade.score, 50 - 7.0 * static_cast<double>(grade.deductions.size()));
  EXPECT_THAT(to_text(*session), HasSubstr("touched a virtual thing  contact_started"));
}

TEST_F(GradeSession, TheReplayedSessionHasExactlyTheSameGrade) {
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

TEST_F(GradeSession, LogAndScoreAreTheSameForAnyNumberOfThreads) {
  const std::string first = record("a.lcm");
  std::map<std::string, std::string> hash;
  for (const int threads : {1, 2, 8}) {
    ReplayOptions again;
    again.log = first;
    again.threads = threads;
    const auto report = replay(again);
    ASSERT_TRUE(report.ok()) << report.error().message;
    if (threads == 1) hash = report->hash;
    EXPECT_EQ(report->hash, hash) << threads << " threads";
  }
}

TEST_F(GradeSession, TheLastPublishedScoreIsThatOfLogAndReport) {
  const std::string path = record("a.lcm", [](Scenario& scenario) {
    scenario.training->penalties[0].points = 0.1;  // sums of these are inexact
    scenario.training->penalties[0].per_impulse = 1.0 / 3;
  });
  std::vector<Event> grading_events;
  auto reader = LogReader::open(path);
  ASSERT_TRUE(reader.ok());
  for (auto next = reader->next(); next && *next; next = reader->next()) {
    Event event;
    if ((*next)->channel != channel::kMrEvents || !decode("", (*next)->payload, event)) continue;
    if (is_grading(event.kind)) grading_events.push_back(event);
  }
  ASSERT_FALSE(grading_events.empty());
  EXPECT_EQ(grading_events.front().kind, EventKind::task_started);
  EXPECT_EQ(grading_events.front().object, "into the hall");
  const auto last = std::find_if(grading_events.rbegin(), grading_events.rend(),
                                 [](const Event& event) { return event.kind == EventKind::score_changed; });
  ASSERT_NE(last, grading_events.rend());
  const auto session = grade_session(path);
  ASSERT_TRUE(session.ok());
  EXPECT_EQ(last->value, session->grade.score);
  EXPECT_NE(last->value, 50) << "the barrel was touched";
  const auto deducted = std::count_if(grading_events.begin(), grading_events.end(), [](const Event& event) {
    return event.kind == EventKind::points_deducted;
  });
  EXPECT_EQ(static_cast<std::size_t>(deducted), session->grade.deductions.size());
  ASSERT_TRUE(report_ && report_->grade);
  EXPECT_EQ(to_json(*report_->grade), to_json(*session)) << "the report's grade is that of the log";
  EXPECT_THAT(to_json(*report_), HasSubstr("\"score\": "));
  for (const char* word : {"\"required\": ", "\"ended\": ", "\"position\": ["})
    EXPECT_THAT(to_json(*session), HasSubstr(word));
  EXPECT_THAT(summary(*report_), HasSubstr("touched a virtual thing"));
}

TEST_F(GradeSession, ATruncatedLogIsGradedToItsEnd) {
  const std::string path = record("a.lcm");
  std::filesystem::resize_file(path, std::filesystem::file_size(path) * 2 / 3 + 5);
  const auto session = grade_session(path);
  ASSERT_TRUE(session.ok()) << session.error().message;
  EXPECT_FALSE(session->grade.complete);
  EXPECT_EQ(session->grade.tasks[0].outcome, training::TaskOutcome::done);
  EXPECT_THAT(to_text(*session), HasSubstr("INCOMPLETE"));
}

TEST_F(GradeSession, TheRobotsClockMayBeSetBackDuringTheSession) {
  const auto plain = grade_session(record("a.lcm"));
  for (Message& each : drive_) {
    if (each.arrival < ArrivalTime::from_utime(test::kStartUs + 1'000'000)) continue;
    auto utime = leading_stamp(each.payload)->utime() - 3'600'000'000;
    for (std::size_t i = 16; i-- > 8; utime >>= 8) each.payload[i] = static_cast<std::uint8_t>(utime);
  }
  const auto set_back = grade_session(record("b.lcm"));
  ASSERT_TRUE(plain.ok() && set_back.ok());
  ASSERT_FALSE(plain->grade.deductions.empty());
  EXPECT_EQ(set_back->grade.deductions.size(), plain->grade.deductions.size());
  EXPECT_EQ(set_back->grade.tasks[0].outcome, training::TaskOutcome::done);
  EXPECT_EQ(set_back->grade.score, plain->grade.score);
  EXPECT_GT(set_back->grade.end, set_back->grade.begin);
  ASSERT_TRUE(report_ && report_->grade);
  EXPECT_EQ(to_json(*report_->grade), to_json(*set_back)) << "the report's grade is that of the log";
}

TEST_F(GradeSession, WhatCannotBeGradedIsRefusedWithTheReason) {
  test::write_log(folder_ / "bare.lcm", test::drive(1));
  EXPECT_THAT(grade_session(folder_ / "bare.lcm").error().message, HasSubstr("no MR_SESSION in it"));
  const std::string path = record("none.lcm", [](Scenario& scenario) { scenario.training.reset(); });
  EXPECT_THAT(grade_session(path).error().message, HasSubstr("nothing to grade"));
  EXPECT_FALSE(grade_session(folder_ / "missing.lcm").ok());
}

TEST_F(GradeSession, ATrainingWithUnknownNamesIsRefusedBeforeTheStart) {
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
}  // namespace parhelion::runtime
