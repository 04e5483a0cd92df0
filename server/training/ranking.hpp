// Rankings of trainees in a course, and in one of its programmes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/course.hpp"
#include "server/training/records.hpp"

namespace parhelion::training {

/// A trainee's best session of a programme: passed before not passed, then the higher fraction of points,
/// then the shorter time. An incomplete session counts with its current grade.
struct ProgrammePlace {
  TraineeRecord trainee;
  SessionRecord best;
  std::size_t sessions = 0;  ///< of this programme
};

/// By the scenario's name; best first, ties in the order in which the trainees were added.
Result<std::vector<ProgrammePlace>> programme_ranking(Records& records, const std::string& scenario);

struct CoursePlace {
  TraineeRecord trainee;
  CourseStanding standing;
  std::vector<std::optional<ProgrammeResult>> best;  ///< parallel to the course's programmes
};

/// By programmes passed, then by the mean fraction of points. Trainees without a session of the course are
/// last. Error: a programme's scenario cannot be read.
Result<std::vector<CoursePlace>> course_ranking(Records& records, const Course& course);

}  // namespace parhelion::training
