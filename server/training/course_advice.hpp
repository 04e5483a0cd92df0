// Recommends a trainee's next task in a course, from the records of the whole group.
#pragma once

#include <string>
#include <vector>

#include "protocols/course.hpp"
#include "server/training/next_task.hpp"
#include "server/training/records.hpp"

namespace parhelion::training {

/// The tasks of all programmes in order; TaskOffer::scenario is the scenario's name, difficulties are those
/// of rank_difficulties(). Error: a scenario cannot be read or has no `training`; no task names a skill.
Result<std::vector<TaskOffer>> course_tasks(const Course& course);

/// The tasks of the course in `sessions`, in order: those that were started, and then done, failed or out of
/// time.
std::vector<Attempt> attempts_of(const std::vector<SessionRecord>& sessions,
                                 const std::vector<TaskOffer>& offers);

struct CourseAdvice {
  NextTask next;
  TaskOffer task;         ///< not set where complete
  std::string programme;  ///< the scenario's file
  std::size_t seen = 0;   ///< tasks of the trainee on which the advice is based
};

/// The group's attempts correct priors and difficulties; the advice is based on the trainee's own attempts.
/// Error: those of course_tasks() and Records.
Result<CourseAdvice> advise(Records& records, const std::string& pseudonym, const Course& course);

}  // namespace parhelion::training
