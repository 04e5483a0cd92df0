// A course: programmes in order of difficulty, and the ranks it awards (the ranking system of the paper,
// section 4.1). Level, tasks and the skills that they train belong to each programme's scenario.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion {

struct CourseProgramme {
  std::string scenario;  ///< path of a scenario with `training`
  std::string text;      ///< what it teaches
};

struct CourseRank {
  std::string name;
  std::uint64_t passed = 0;  ///< minimum number of programmes
  double from = 0;           ///< minimum mean fraction of the points over all programmes, 0..1
};

struct Course {
  std::string name, text;
  std::vector<CourseProgramme> programmes;  ///< the easiest first; without duplicates
  std::vector<CourseRank> ranking;          ///< the highest first
};

/// A trainee's best session of one programme.
struct ProgrammeResult {
  double fraction = 0;  ///< of the points, 0..1
  bool passed = false;
};

struct CourseStanding {
  std::string rank;                 ///< empty: none yet
  std::size_t passed = 0;           ///< programmes
  double fraction = 0;              ///< mean over all programmes; those not driven yet count as 0
  std::optional<std::size_t> next;  ///< first programme that is not passed; none: all are passed
};

/// Reads YAML (schema course.schema.json). Paths are kept as written; the scenarios are not read.
Result<Course> parse_course(const std::string& yaml, const std::string& origin);
/// The same from a file; paths of scenarios are resolved against its folder.
Result<Course> load_course(const std::string& path);

/// `best`: one for each programme of the course, in its order; none: not driven yet.
CourseStanding standing_in(const Course& course, const std::vector<std::optional<ProgrammeResult>>& best);

}  // namespace parhelion
