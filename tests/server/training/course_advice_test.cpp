// Which records count as tries at a course's task.
#include "server/training/course_advice.hpp"

#include <gtest/gtest.h>

namespace parhelion::training {
namespace {

TEST(CourseAdvice, AnUnstartedTaskIsNoFailure) {
  const std::vector<TaskOffer> offers{{"lesson", "first", {"doors"}, 1, 0},
                                      {"lesson", "second", {"stairs"}, 1, 0},
                                      {"lesson", "third", {"stairs"}, 1, 0}};
  SessionRecord session;
  session.scenario = "lesson";
  const auto went = [&](const char* name, TaskOutcome outcome, bool begun) {
    TaskGrade& task = session.grade.tasks.emplace_back();
    task.name = name;
    task.outcome = outcome;
    if (begun) task.began = SimulationTime{0};
  };
  went("first", TaskOutcome::failed, true);
  went("second", TaskOutcome::out_of_time, false);  // the session ended before this task
  went("third", TaskOutcome::open, true);
  went("of another course", TaskOutcome::done, true);
  session.grade.tasks.push_back(session.grade.tasks[1]);
  session.grade.tasks.back().began = SimulationTime{5};
  const auto attempts = attempts_of({session}, offers);
  ASSERT_EQ(attempts.size(), 2U);
  EXPECT_EQ(attempts[0].offer, 0U);
  EXPECT_FALSE(attempts[0].done);
  EXPECT_EQ(attempts[1].offer, 1U) << "begun it counts";
}

}  // namespace
}  // namespace parhelion::training
