// What a trainee should do next in a course, from the records of the whole group.
#pragma once

#include <string>
#include <vector>

#include "protocols/course.hpp"
#include "server/training/next_task.hpp"
#include "server/training/records.hpp"

namespace parhelion::training {

/// The tasks of all programmes in their order; TaskOffer::scenario is the scenario's name, difficulties as
/// rank_difficulties() says. Error: a scenario cannot be read or has no `training`; no task names a skill.
Result<std::vector<TaskOffer>> course_tasks(const Course& course);

/// What of `sessions` are tasks of the course, in their order: those that were begun, and then done, failed
/// or out of time.
std::vector<Attempt> attempts_of(const std::vector<SessionRecord>& sessions,
                                 const std::vector<TaskOffer>& offers);

struct CourseAdvice {
  NextTask next;
  TaskOffer task;         ///< not set where complete
  std::string programme;  ///< the scenario's file
  std::size_t seen = 0;   ///< tasks of the trainee that it is judged by
};

/// The group's attempts correct what is believed beforehand and the difficulties; the trainee's own decide.
/// Error: as course_tasks() and Records say.
Result<CourseAdvice> advise(Records& records, const std::string& pseudonym, const Course& course);

}  // namespace parhelion::training
