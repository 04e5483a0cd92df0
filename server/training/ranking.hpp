// Who stands where: in a course, and in one of its programmes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/course.hpp"
#include "server/training/records.hpp"

namespace parhelion::training {

/// A trainee's best session of a programme: one that was passed before one that was not, then the larger
/// share of the points, then the shorter. One that is incomplete counts as it stands.
struct ProgrammePlace {
  TraineeRecord trainee;
  SessionRecord best;
  std::size_t sessions = 0;  ///< of this programme
};

/// By the scenario's name; the best first, equals in the order in which the trainees were added.
Result<std::vector<ProgrammePlace>> programme_ranking(Records& records, const std::string& scenario);

struct CoursePlace {
  TraineeRecord trainee;
  CourseStanding standing;
  std::vector<std::optional<ProgrammeResult>> best;  ///< as the course's programmes
};

/// By programmes passed, then by the mean share of the points. Trainees without a session of the course are
/// last. Error: a programme's scenario cannot be read.
Result<std::vector<CoursePlace>> course_ranking(Records& records, const Course& course);

}  // namespace parhelion::training
